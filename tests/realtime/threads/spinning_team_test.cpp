#include "realtime/threads/spinning_team.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <numeric>
#include <set>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sched.h>

#include "realtime/clocks/periodic_clock.hpp"
#include "realtime/threads/host_time.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;

/// More threads than cores would be refused, but the tests must also run on small machines.
constexpr int kManyCores = 64;

std::unique_ptr<SpinningTeam> team_of(int size, const SpinningTeam::Setup& setup = {}) {
  auto team = SpinningTeam::create(size, setup, kManyCores);
  EXPECT_TRUE(team);
  return std::move(*team);
}

TEST(SpinningTeam, RunsEveryPartOnceOnItsOwnThread) {
  for (int size = 1; size <= 4; ++size) {
    const auto team = team_of(size);
    EXPECT_EQ(team->size(), size);
    for (int parts = 1; parts <= size; ++parts) {
      struct Work {
        std::array<int, 4> calls{};
        std::array<std::thread::id, 4> by{};
      } work;
      team->run(
          parts,
          [](void* context, int part) noexcept {
            auto& of = *static_cast<Work*>(context);
            ++of.calls[static_cast<std::size_t>(part)];
            of.by[static_cast<std::size_t>(part)] = std::this_thread::get_id();
          },
          &work);
      for (int part = 0; part < 4; ++part) {
        EXPECT_EQ(work.calls[static_cast<std::size_t>(part)], part < parts ? 1 : 0);
      }
      EXPECT_EQ(work.by[0], std::this_thread::get_id());
      const auto used = static_cast<std::size_t>(parts);
      EXPECT_EQ(std::set(work.by.begin(), work.by.begin() + parts).size(), used);
    }
  }
}

/// Each part writes its cell of a row and, after a barrier, reads the whole row: if the barrier
/// lets a thread through early, a sum is wrong.
struct Rows {
  static constexpr int kParts = 3;
  static constexpr int kRows = 500;
  SpinningTeam* team = nullptr;
  std::vector<std::array<int, kParts>> cells = std::vector<std::array<int, kParts>>(kRows);
  std::array<std::uint64_t, kParts> wrong{};

  static void part(void* context, int part) noexcept {
    auto& rows = *static_cast<Rows*>(context);
    const auto own = static_cast<std::size_t>(part);
    for (int row = 0; row < kRows; ++row) {
      auto& cells = rows.cells[static_cast<std::size_t>(row)];
      cells[own] = row + part + 1;
      rows.team->barrier();
      if (cells[0] + cells[1] + cells[2] != 3 * row + 6) ++rows.wrong[own];
    }
  }
};

TEST(SpinningTeam, TheBarrierLetsNoThreadThroughEarly) {
  const auto team = team_of(Rows::kParts);
  for (int repeat = 0; repeat < 6; ++repeat) {
    Rows rows;
    rows.team = team.get();
    team->run(Rows::kParts, &Rows::part, &rows);
    EXPECT_EQ(rows.wrong, (std::array<std::uint64_t, 3>{}));
  }
}

TEST(SpinningTeam, ABarrierWithOnePartReturnsAtOnce) {
  const auto team = team_of(2);
  team->run(
      1, [](void* context, int) noexcept { static_cast<SpinningTeam*>(context)->barrier(); },
      team.get());
}

TEST(SpinningTeam, CallsWithFewerPartsMixWithFullCalls) {
  const auto team = team_of(3);
  std::atomic<int> calls{0};
  int expected = 0;
  for (int k = 0; k < 3000; ++k) {
    const int parts = 1 + k % 3;
    expected += parts;
    team->run(
        parts, [](void* context, int) noexcept { ++*static_cast<std::atomic<int>*>(context); },
        &calls);
    ASSERT_EQ(calls, expected);
  }
}

TEST(SpinningTeam, WorkBeforeOrAfterTheAnnouncedTimeIsDone) {
  const auto team = team_of(2);
  PeriodicClock clock;
  std::atomic<int> calls{0};
  const auto work = [](void* context, int) noexcept { ++*static_cast<std::atomic<int>*>(context); };
  team->rest_until(clock.now() + microseconds{2000});  // announced: sleeps, then spins
  host_sleep_until(clock.now() + microseconds{1000});
  team->run(2, work, &calls);
  host_sleep_until(clock.now() + microseconds{3000});  // long after: polls
  team->run(2, work, &calls);
  EXPECT_EQ(calls, 4);
}

TEST(SpinningTeam, SetsUpEachWorkerOnItsOwnThread) {
  std::array<std::atomic<std::size_t>, 3> by{};
  {
    const auto team = team_of(3, [&by](int worker) {
      by[static_cast<std::size_t>(worker)] =
          std::hash<std::thread::id>()(std::this_thread::get_id());
    });
    int unused = 0;
    team->run(
        3, [](void*, int) noexcept {}, &unused);
  }
  EXPECT_EQ(by[0], 0U);
  EXPECT_NE(by[1], 0U);
  EXPECT_NE(by[2], 0U);
  EXPECT_NE(by[1], by[2]);
}

TEST(SpinningTeam, EndsWithoutHavingWorked) {
  const auto team = team_of(4);
  EXPECT_EQ(team->size(), 4);
}

TEST(SpinningTeam, CountsTheCoresThatItMayUse) {
  int cores = 0;
  std::thread([&cores] {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(static_cast<std::size_t>(::sched_getcpu()), &one);
    ASSERT_EQ(::sched_setaffinity(0, sizeof one, &one), 0);
    cores = SpinningTeam::available_cores();
  }).join();
  EXPECT_EQ(cores, 1);
}

TEST(SpinningTeam, RefusesMoreThreadsThanCores) {
  EXPECT_GE(SpinningTeam::available_cores(), 1);
  const auto team = SpinningTeam::create(3, {}, 2);
  ASSERT_FALSE(team);
  EXPECT_EQ(team.error().sentence,
            "loop.threads = 3 must be from 1 to 2, the number of cores available to merkel");
  EXPECT_FALSE(SpinningTeam::create(0, {}, 2));
}

}  // namespace
}  // namespace merkel
