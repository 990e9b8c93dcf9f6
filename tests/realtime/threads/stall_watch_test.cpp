#include "realtime/threads/stall_watch.hpp"

#include <chrono>
#include <csignal>
#include <thread>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace merkel {
namespace {

using std::chrono::milliseconds;

constexpr int kFound = 0;
constexpr int kNotFound = 1;

/// Stops this process for 100 ms while it watches. \return whether it noticed
int watch_while_stopped() {
  StallWatch watch({});
  const pid_t self = ::getpid();
  if (::fork() == 0) {
    std::this_thread::sleep_for(milliseconds{100});
    ::kill(self, SIGSTOP);
    std::this_thread::sleep_for(milliseconds{100});
    ::kill(self, SIGCONT);
    ::_exit(0);
  }
  std::this_thread::sleep_for(milliseconds{400});
  StallWatch::Stall stall;
  while (watch.take(stall)) {
    if (stall.end - stall.begin > milliseconds{60}) return kFound;
  }
  return kNotFound;
}

TEST(StallWatch, NoticesThatTheCoreDidNotRunTheProcess) {
  bool permitted = false;
  std::thread([&] { permitted = set_up_watch_thread({}, 0); }).join();
  if (!permitted || std::thread::hardware_concurrency() > StallWatch::kMaxCores) {
    GTEST_SKIP() << "needs the right to SCHED_FIFO, and few cores";
  }
  const pid_t child = ::fork();
  if (child == 0) ::_exit(watch_while_stopped());
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), kFound);
}

TEST(StallWatch, WithoutAPriorityThereIsNothingToWatch) {
  StallWatch watch({.fifo = false});
  std::this_thread::sleep_for(milliseconds{20});
  StallWatch::Stall stall;
  EXPECT_FALSE(watch.take(stall));
}

}  // namespace
}  // namespace merkel
