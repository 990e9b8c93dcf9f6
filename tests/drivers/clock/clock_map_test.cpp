#include "drivers/clock/clock_map.hpp"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace merkel {
namespace {

using std::chrono::nanoseconds;
using std::chrono::seconds;

/// A clock that is ahead of another by an offset and runs at another rate.
nanoseconds other_clock(nanoseconds time, double offset_s, double rate_ppm) {
  return time + nanoseconds{static_cast<std::int64_t>(
                    offset_s * 1e9 + rate_ppm * 1e-6 * static_cast<double>(time.count()))};
}

std::vector<ClockReading> events(const std::vector<int>& at_s, double offset_s, double rate_ppm,
                                 const std::vector<int>& jitter_us = {}) {
  std::vector<ClockReading> all;
  for (std::size_t i = 0; i < at_s.size(); ++i) {
    const nanoseconds time = seconds{1000 + at_s[i]};
    const nanoseconds jitter = std::chrono::microseconds{i < jitter_us.size() ? jitter_us[i] : 0};
    all.push_back({.from = other_clock(time, offset_s, rate_ppm) + jitter, .to = time});
  }
  return all;
}

/// The largest error of converted times from 0 to `last_s` seconds.
double largest_error_ms(const ClockMap& map, double offset_s, double rate_ppm, int last_s) {
  double largest_ms = 0.0;
  for (int s = 0; s <= last_s; ++s) {
    const nanoseconds time = seconds{1000 + s};
    const nanoseconds error = map(other_clock(time, offset_s, rate_ppm)) - time;
    largest_ms = std::max(largest_ms, std::abs(static_cast<double>(error.count())) * 1e-6);
  }
  return largest_ms;
}

TEST(ClockMap, TwoEventsDetermineOffsetAndRate) {
  for (const auto& [offset_s, rate_ppm] : {std::pair(3.25, 50.0), std::pair(-1.5, -300.0)}) {
    const auto fit = fit_clocks(events({5, 170}, offset_s, rate_ppm),
                                other_clock(seconds{1000}, offset_s, rate_ppm),
                                other_clock(seconds{1200}, offset_s, rate_ppm));
    EXPECT_LT(largest_error_ms(fit.map, offset_s, rate_ppm, 200), 0.2) << rate_ppm;
    ASSERT_TRUE(fit.residual);
    EXPECT_LT(*fit.residual, nanoseconds{200'000});
    EXPECT_GT(*fit.residual, nanoseconds{0});  // nothing checks them
    EXPECT_NEAR(fit.map.rate() * 1e6, -rate_ppm, 0.1);
  }
}

TEST(ClockMap, TheResidualCoversTheErrorOfEventsWithJitter) {
  const auto fit =
      fit_clocks(events({0, 40, 80, 120}, 3.25, 50.0, {300, -200, 250, -300}),
                 other_clock(seconds{1000}, 3.25, 50.0), other_clock(seconds{1600}, 3.25, 50.0));
  ASSERT_TRUE(fit.residual);
  const double residual_ms = static_cast<double>(fit.residual->count()) * 1e-6;
  EXPECT_GE(residual_ms, largest_error_ms(fit.map, 3.25, 50.0, 600));
  EXPECT_GT(residual_ms, 0.3);
}

TEST(ClockMap, TheResidualGrowsBeyondTheEvents) {
  const auto marks = events({0, 40, 80, 120}, 0.0, 50.0, {300, -200, 250, -300});
  const auto inside = fit_clocks(marks, seconds{1000}, seconds{1120});
  const auto beyond = fit_clocks(marks, seconds{1000}, seconds{4600});
  EXPECT_GT(*beyond.residual, 5 * *inside.residual);
}

TEST(ClockMap, ARateThatChangesIsFollowedPieceByPiece) {
  // 0 ppm for 100 s, then 100 ppm: 10 ms at the end, 2.5 ms off one line.
  std::vector<ClockReading> marks;
  for (int s = 0; s <= 200; s += 10) {
    const nanoseconds ahead{s > 100 ? (s - 100) * 100'000 : 0};
    marks.push_back({.from = seconds{s} + ahead, .to = seconds{s}});
  }
  const auto fit = fit_clocks(marks, seconds{0}, seconds{200});
  for (const ClockReading& each : marks) {
    EXPECT_LE(std::chrono::abs(fit.map(each.from) - each.to), nanoseconds{1});
  }
  ASSERT_TRUE(fit.residual);
  EXPECT_LT(*fit.residual, std::chrono::milliseconds{1});
  EXPECT_GE(*fit.residual, std::chrono::microseconds{250});  // at the bend
}

TEST(ClockMap, EventsTooCloseForARateGiveTheirMeanOffset) {
  const auto fit = fit_clocks(
      {{seconds{10}, seconds{20}}, {seconds{11}, seconds{21} + std::chrono::milliseconds{4}}},
      seconds{0}, seconds{1000});
  EXPECT_EQ(fit.map(seconds{500}), seconds{510} + std::chrono::milliseconds{2});
  EXPECT_EQ(fit.residual, std::chrono::milliseconds{2});
  EXPECT_EQ(fit.map.rate(), 0.0);
  EXPECT_FALSE(fit_clocks({{seconds{10}, seconds{20}}}, seconds{0}, seconds{1000}).residual);
}

TEST(ClockMap, ComposesAndInverts) {
  const ClockMap one({{seconds{0}, seconds{100}},
                      {seconds{10}, seconds{110} + std::chrono::microseconds{5}},
                      {seconds{30}, seconds{130}}});
  const ClockMap two({{seconds{105}, seconds{5}}, {seconds{205}, seconds{105}}});
  for (int s = -5; s <= 40; ++s) {
    const nanoseconds time = seconds{s};
    EXPECT_LE(std::chrono::abs(one.inverse()(one(time)) - time), nanoseconds{1});
    EXPECT_LE(std::chrono::abs(one.then(two)(time) - two(one(time))), nanoseconds{2});
  }
  EXPECT_EQ(ClockMap().then(two)(seconds{105}), seconds{5});
  EXPECT_EQ(ClockMap()(seconds{7}), seconds{7});
}

}  // namespace
}  // namespace merkel
