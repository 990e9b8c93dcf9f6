#include "realtime/clocks/periodic_clock.hpp"

#include <gtest/gtest.h>

#include "realtime/clocks/publish_beat.hpp"
#include "realtime/threads/host_time.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

TEST(PeriodicClock, NeverWakesBeforeTheDeadline) {
  for (const LoopWait wait : {LoopWait::kHybrid, LoopWait::kSleep}) {
    PeriodicClock clock({.wait = wait, .period = milliseconds{1}});
    clock.calibrate();
    EXPECT_GT(clock.margin().count(), 0);
    EXPECT_LE(clock.margin(), microseconds{200});
    for (int i = 0; i < 20; ++i) {
      const nanoseconds deadline = PeriodicClock::now() + microseconds{50 * i};
      clock.wait_until(deadline);
      EXPECT_GE(PeriodicClock::now(), deadline);
    }
  }
}

TEST(PeriodicClock, DoesNotWaitForAPastDeadline) {
  PeriodicClock clock({.wait = LoopWait::kHybrid, .period = milliseconds{1}});
  clock.wait_until(nanoseconds{0});
  clock.wait_until(nanoseconds::min());
  host_sleep_until(nanoseconds{1});
  SUCCEED();
}

TEST(PublishBeat, ReturnsAtOnceWhenATickWasPublished) {
  PublishBeat beat;
  std::uint64_t seen = 0;
  beat.published({}, microseconds{10});
  beat.published({}, microseconds{10});
  beat.wait(seen);
  EXPECT_EQ(seen, 2U);
}

TEST(PublishBeat, WaitsForTheExpectedTickButNotForever) {
  PublishBeat beat;
  std::uint64_t seen = 0;
  const nanoseconds due = PeriodicClock::now() + milliseconds{2};
  beat.expect(due);
  beat.wait(seen);  // it never comes
  EXPECT_EQ(seen, 0U);
  EXPECT_GT(PeriodicClock::now(), due);
}

TEST(PublishBeat, WaitsInVirtualTimeToo) {
  PublishBeat beat;
  std::uint64_t seen = 0;
  beat.wait(seen);
  EXPECT_EQ(seen, 0U);
}

}  // namespace
}  // namespace merkel
