#include "realtime/threads/thread_setup.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <stop_token>
#include <thread>

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include "realtime/threads/host_time.hpp"
#include "realtime/threads/raised_threads.hpp"
#include "realtime/threads/serving_priority.hpp"

namespace merkel {
namespace {

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(ThreadSetup, NamesTheMissingRightAndItsRemedy) {
  const std::string at_home = fifo_refusal({.rtprio_limit = 20}, 70);
  EXPECT_TRUE(contains(at_home, "CAP_SYS_NICE")) << at_home;
  EXPECT_TRUE(contains(at_home, "at least 70 (it is 20)")) << at_home;
  EXPECT_TRUE(contains(at_home, "\"@realtime - rtprio 70\" to /etc/security/limits.d")) << at_home;
  const std::string contained = fifo_refusal({.container = true}, 50);
  EXPECT_TRUE(contains(contained, "--cap-add=SYS_NICE --ulimit rtprio=50")) << contained;
  for (const RightsFacts& facts :
       {RightsFacts{.cap_sys_nice = true}, RightsFacts{.rtprio_limit = 70}}) {
    const std::string group = fifo_refusal(facts, 70);
    EXPECT_TRUE(contains(group, "RT_GROUP_SCHED")) << group;
    EXPECT_TRUE(contains(group, "cpu.rt_runtime_us")) << group;
  }
  const std::string memory = memory_lock_refusal({.memlock_limit_bytes = 8U << 20U});
  EXPECT_TRUE(contains(memory, "8192 KiB")) << memory;
  EXPECT_TRUE(contains(memory, "memlock unlimited")) << memory;
  EXPECT_TRUE(contains(memory_lock_refusal({.container = true}), "--ulimit memlock=-1"));
}

TEST(ThreadSetup, RefusesThePriorityOfTheKernelsThreads) {
  EXPECT_TRUE(RealtimeSettings{.priority = 98}.check());
  EXPECT_EQ(RealtimeSettings{.priority = 99}.check().error().key, "loop.priority");
  EXPECT_FALSE(RealtimeSettings{.priority = 0}.check());
  EXPECT_EQ(RealtimeSettings{.cpu = -1}.check().error().key, "loop.cpu");
}

/// Either the thread is raised, or it reports why not and has a timer slack of 1 ns.
TEST(ThreadSetup, RaisesOnlyItsOwnThreadOrReportsWhyNot) {
  std::jthread([] {
    RealtimeRights rights;
    set_up_simulation_thread({.priority = 5}, rights);
    std::array<char, 16> name{};
    ::pthread_getname_np(::pthread_self(), name.data(), name.size());
    EXPECT_STREQ(name.data(), "merkel-sim");
    const int policy = ::sched_getscheduler(0);
    if (rights.fifo) {
      EXPECT_EQ(policy, SCHED_FIFO | SCHED_RESET_ON_FORK);
      EXPECT_EQ(rights.priority, 5);
      EXPECT_TRUE(rights.missing.empty());
      std::jthread([] { EXPECT_EQ(::sched_getscheduler(0), SCHED_OTHER); }).join();
    } else {
      EXPECT_EQ(policy, SCHED_OTHER);
      EXPECT_EQ(::prctl(PR_GET_TIMERSLACK), 1);
      EXPECT_EQ(rights.missing.size(), 1U);
    }
  }).join();
  EXPECT_EQ(::sched_getscheduler(0), SCHED_OTHER);
}

TEST(ServingPriority, IsJustBelowTheSimulationUntilAThreadComputesTooMuch) {
  std::jthread([] {
    RealtimeRights rights;
    std::jthread([&] { set_up_simulation_thread({.priority = 5}, rights); }).join();
    EXPECT_EQ(ServingPriority({}).raised(), 0U);
    EXPECT_EQ(ServingPriority(RealtimeSettings{.fifo = false}).raised(), 0U);
    std::atomic<pid_t> transport{0};
    std::jthread sleeping([&](const std::stop_token& stop) {
      transport = this_thread();
      transport.notify_all();
      while (!stop.stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds{1});
    });
    transport.wait(0);
    const std::array<pid_t, 1> others = {transport};
    ServingPriority priority(RealtimeSettings{.priority = 5}, others);
    if (!rights.fifo) GTEST_SKIP() << rights.missing.front();
    EXPECT_EQ(priority.raised(), 2U);
    for (const pid_t thread : {this_thread(), transport.load()}) {
      sched_param parameters{};
      ::sched_getparam(thread, &parameters);
      EXPECT_EQ(parameters.sched_priority, 4);
    }
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{10};
    while (priority.raised() == 2 && std::chrono::steady_clock::now() < end) {
      priority.check(host_now());
    }
    EXPECT_EQ(priority.raised(), 1U);
    EXPECT_EQ(::sched_getscheduler(0), SCHED_OTHER);
    EXPECT_EQ(::sched_getscheduler(transport), SCHED_FIFO | SCHED_RESET_ON_FORK);
    EXPECT_FALSE(simulation_was_demoted());
  }).join();
}

#ifndef MERKEL_SANITIZED  // sanitizers hold signals back
TEST(ThreadSetup, AThreadThatNeverSleepsIsDemoted) {
  std::jthread([] {
    RealtimeRights rights;
    set_up_simulation_thread({.priority = 1}, rights);
    if (!rights.fifo) GTEST_SKIP() << rights.missing.front();
    EXPECT_FALSE(simulation_was_demoted());
    // About a second of computing is enough, unless the host gives the core to other threads.
    for (std::uint64_t k = 0; k < 20'000'000'000 && !simulation_was_demoted(); ++k) {
    }
    EXPECT_TRUE(simulation_was_demoted());
    EXPECT_EQ(::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK, SCHED_OTHER);
  }).join();
}
#endif

TEST(ThreadSetup, StaysInSchedOtherOnRequest) {
  std::jthread([] {
    RealtimeRights rights;
    set_up_simulation_thread({.fifo = false}, rights);
    EXPECT_FALSE(rights.fifo);
    EXPECT_TRUE(rights.missing.empty());
    EXPECT_EQ(::sched_getscheduler(0), SCHED_OTHER);
    EXPECT_EQ(::prctl(PR_GET_TIMERSLACK), 1);
  }).join();
}

TEST(ThreadSetup, PinsToTheCoreOrReportsThatItCannot) {
  std::jthread([] {
    RealtimeRights rights;
    set_up_simulation_thread({.fifo = false, .cpu = ::sched_getcpu()}, rights);
    ASSERT_TRUE(rights.cpu);
    EXPECT_EQ(::sched_getcpu(), *rights.cpu);
  }).join();
  std::jthread([] {
    RealtimeRights rights;
    set_up_simulation_thread({.fifo = false, .cpu = CPU_SETSIZE - 1}, rights);
    EXPECT_FALSE(rights.cpu);
    ASSERT_EQ(rights.missing.size(), 1U);
    EXPECT_TRUE(contains(rights.missing[0], "core 1023 is not available to merkel"));
  }).join();
}

TEST(ThreadSetup, EveryRefusalOfTheProcessHasASentence) {
  RealtimeRights rights;
  {
    const ProcessSetup process({}, rights);
    const std::size_t refused = (rights.memory_locked ? 0U : 1U) + (rights.cpu_awake ? 0U : 1U);
    EXPECT_EQ(rights.missing.size(), refused);
  }
  RealtimeRights none;
  const ProcessSetup process({.lock_memory = false, .cpu_awake = false}, none);
  EXPECT_FALSE(none.memory_locked);
  EXPECT_FALSE(none.cpu_awake);
  EXPECT_TRUE(none.missing.empty());
}

TEST(ThreadUsage, CountsFaultsAndSwitches) {
  const ThreadUsage before = ThreadUsage::of_this_thread();
  // Not from malloc, which hands out pages that an earlier test has touched.
  constexpr std::size_t kBytes = 4 << 20;
  void* const mapped =
      ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(mapped, MAP_FAILED);
  for (std::size_t i = 0; i < kBytes; i += 4096) static_cast<volatile char*>(mapped)[i] = 1;
  ::munmap(mapped, kBytes);
  std::this_thread::sleep_for(std::chrono::milliseconds{1});
  const ThreadUsage since = ThreadUsage::of_this_thread().since(before);
  EXPECT_GT(since.minor_faults, 0U);
  EXPECT_GT(since.voluntary_switches, 0U);
}

}  // namespace
}  // namespace merkel
