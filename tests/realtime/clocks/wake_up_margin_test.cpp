#include "realtime/clocks/wake_up_margin.hpp"

#include <gtest/gtest.h>

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

TEST(WakeUpMargin, CoversThe99thPercentile) {
  WakeUpMargin margin(milliseconds{1});
  for (int i = 0; i < 256; ++i) margin.add(microseconds{i % 100 == 99 ? 3000 : 40});
  EXPECT_EQ(margin.margin(), microseconds{55});  // 1.25 · 40 + 5
}

TEST(WakeUpMargin, FollowsAHostThatGetsSlowerOrFaster) {
  WakeUpMargin margin(milliseconds{1});
  for (int i = 0; i < 256; ++i) margin.add(microseconds{20});
  EXPECT_EQ(margin.margin(), microseconds{30});
  for (int i = 0; i < 32; ++i) margin.add(microseconds{100});
  EXPECT_EQ(margin.margin(), microseconds{130});
  for (int i = 0; i < 256; ++i) margin.add(microseconds{20});
  EXPECT_EQ(margin.margin(), microseconds{30});
}

TEST(WakeUpMargin, LearnsFromTheFirstFewSleeps) {
  WakeUpMargin margin(milliseconds{1});
  for (int i = 0; i < 32; ++i) margin.add(microseconds{100});
  EXPECT_EQ(margin.margin(), microseconds{130});
}

TEST(WakeUpMargin, LeavesHalfOfEveryPeriodToSleep) {
  for (const nanoseconds period : {milliseconds{10}, milliseconds{1}, milliseconds{0}}) {
    for (const nanoseconds latency : {milliseconds{50}, milliseconds{0}}) {
      for (const nanoseconds of : {period, nanoseconds{microseconds{250}}}) {
        WakeUpMargin margin(of);
        for (int i = 0; i < 1000; ++i) {
          EXPECT_LE(margin.margin(), of / 2);
          EXPECT_LE(margin.margin(), WakeUpMargin::kMax);
          margin.add(latency);
        }
      }
    }
  }
}

}  // namespace
}  // namespace merkel
