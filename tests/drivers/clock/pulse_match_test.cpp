#include "drivers/clock/pulse_match.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "tests/text_has.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;
using Times = std::vector<nanoseconds>;

/// Begins of pulses at irregular intervals of 60 to 500 ms.
Times pulses_over(nanoseconds length, std::uint64_t seed) {
  Random random(seed);
  Times times;
  for (nanoseconds time{0}; time < length;) {
    time += nanoseconds{static_cast<std::int64_t>(60e6 + 440e6 * random.uniform())};
    times.push_back(time);
  }
  return times;
}

/// A recorder: the time of its clock at a true time, and the faults of its line.
struct Recorder {
  double offset_s = 0.0;
  double rate_ppm = 0.0;
  double wander_ppm = 0.0;  ///< of the rate, within an hour
  double missing = 0.0;
  double extra = 0.0;
  double jitter_us = 0.0;  ///< at most

  [[nodiscard]] nanoseconds at(nanoseconds time) const {
    const double s = 1e-9 * static_cast<double>(time.count());
    const double period_s = 3600.0;
    const double wandered =
        1e-6 * wander_ppm * period_s / 6.2832 * (1.0 - std::cos(6.2832 * s / period_s));
    return time + nanoseconds{std::llround(1e9 * (offset_s + 1e-6 * rate_ppm * s + wandered))};
  }
  [[nodiscard]] Times sees(const Times& pulses, std::uint64_t seed) const {
    Random random(seed);
    Times seen;
    for (const nanoseconds each : pulses) {
      if (random.uniform() < extra) {
        seen.push_back(at(each - nanoseconds{std::llround(50e6 * random.uniform())}));
      }
      if (random.uniform() < missing) continue;
      seen.push_back(at(each) +
                     nanoseconds{std::llround(1e3 * jitter_us * (2.0 * random.uniform() - 1.0))});
    }
    std::sort(seen.begin(), seen.end());
    return seen;
  }
};

constexpr milliseconds kTolerance{2};

/// The largest error of converted times over a run, in ms.
double largest_map_error_ms(const ClockMap& map, const Recorder& from, const Recorder& to,
                            nanoseconds length) {
  double largest = 0.0;
  for (nanoseconds time{0}; time < length; time += milliseconds{777}) {
    const nanoseconds error = map(from.at(time)) - to.at(time);
    largest = std::max(largest, 1e-6 * std::fabs(static_cast<double>(error.count())));
  }
  return largest;
}

TEST(PulseMatch, TwoHoursAtAHundredPpmWithMissingAndExtraPulsesAreExactToATenthOfAMillisecond) {
  const nanoseconds length = std::chrono::hours{2};
  const Times pulses = pulses_over(length, 1);
  const Recorder own{.missing = 0.03, .extra = 0.01, .jitter_us = 20.0};
  const Recorder other{
      .offset_s = 1234.5, .rate_ppm = 100.0, .missing = 0.03, .extra = 0.01, .jitter_us = 20.0};
  const Times from = own.sees(pulses, 2);
  const Times to = other.sees(pulses, 3);
  auto match = match_pulses(from, to, kTolerance);
  ASSERT_TRUE(match) << match.error();
  const auto fit = fit_pulses(*match, own.at(nanoseconds{0}), own.at(length));
  EXPECT_LT(largest_map_error_ms(fit.map, own, other, length), 0.1);
  ASSERT_TRUE(fit.residual);
  EXPECT_LT(*fit.residual, microseconds{100});
  EXPECT_NEAR(fit.map.rate() * 1e6, 100.0, 0.01);
  EXPECT_EQ(match->total, from.size());
  EXPECT_EQ(match->total_other, to.size());
  EXPECT_GT(static_cast<double>(match->pairs.size()), 0.92 * static_cast<double>(from.size()));
  EXPECT_LE(match->pairs.size(), pulses.size());
}

TEST(PulseMatch, AClockThatWandersIsFollowedPieceByPiece) {
  const nanoseconds length = std::chrono::hours{2};
  const Times pulses = pulses_over(length, 4);
  const Recorder own{.missing = 0.03, .jitter_us = 20.0};
  const Recorder other{.offset_s = -77.0, .rate_ppm = -40.0, .wander_ppm = 3.0, .jitter_us = 20.0};
  auto match = match_pulses(own.sees(pulses, 5), other.sees(pulses, 6), kTolerance);
  ASSERT_TRUE(match) << match.error();
  const auto fit = fit_pulses(*match, own.at(nanoseconds{0}), own.at(length));
  EXPECT_LT(largest_map_error_ms(fit.map, own, other, length), 0.1);
  EXPECT_GT(fit.map.pieces(), 10U);
}

TEST(PulseMatch, PulsesSampledAtAMillisecondAreMatchedAndAveraged) {
  const nanoseconds length = std::chrono::minutes{10};
  const Times pulses = pulses_over(length, 7);
  const Recorder own{.jitter_us = 500.0};
  const Recorder other{.offset_s = 3.25, .rate_ppm = 50.0};
  auto match = match_pulses(own.sees(pulses, 8), other.sees(pulses, 9), kTolerance);
  ASSERT_TRUE(match) << match.error();
  const auto fit = fit_pulses(*match, own.at(nanoseconds{0}), own.at(length));
  EXPECT_LT(largest_map_error_ms(fit.map, own, other, length), 0.2);
}

TEST(PulseMatch, ARecorderThatSawOnlyAPartOfTheRunIsPlaced) {
  const Times pulses = pulses_over(std::chrono::hours{2}, 10);
  const Recorder other{.offset_s = 50.0, .rate_ppm = 80.0, .missing = 0.05, .jitter_us = 20.0};
  Times part = other.sees(pulses, 11);
  part.erase(part.begin(), part.begin() + static_cast<std::ptrdiff_t>(part.size() / 2));
  part.resize(400);
  auto match = match_pulses(pulses, part, kTolerance);
  ASSERT_TRUE(match) << match.error();
  EXPECT_EQ(match->total_other, 400U);
  EXPECT_GT(match->pairs.size(), 390U);
  const auto fit = fit_pulses(*match, match->pairs.front().from, match->pairs.back().from);
  for (const ClockReading& each : match->pairs) {
    EXPECT_LT(std::chrono::abs(fit.map(each.from) - each.to), microseconds{100});
  }
}

TEST(PulseMatch, ALineThatWasUnpluggedForAWhileIsMatchedBeforeAndAfter) {
  const nanoseconds length = std::chrono::minutes{30};
  const Times pulses = pulses_over(length, 12);
  const Recorder other{.offset_s = 9.0, .rate_ppm = 60.0, .jitter_us = 20.0};
  Times to = other.sees(pulses, 13);
  std::erase_if(to, [](nanoseconds each) { return each > seconds{600} && each < seconds{900}; });
  auto match = match_pulses(pulses, to, kTolerance);
  ASSERT_TRUE(match) << match.error();
  EXPECT_EQ(match->pairs.size(), to.size());
  const auto fit = fit_pulses(*match, nanoseconds{0}, length);
  EXPECT_LT(largest_map_error_ms(fit.map, {}, other, length), 0.1);
}

TEST(PulseMatch, ExtraPulsesBesideOthersMakeNoSecondPlace) {
  const nanoseconds length = std::chrono::minutes{4};
  for (std::uint64_t seed = 100; seed < 150; ++seed) {
    const Times pulses = pulses_over(length, seed);
    const Recorder own{.missing = 0.03, .extra = 0.05, .jitter_us = 20.0};
    const Recorder other{
        .offset_s = 3.25, .rate_ppm = -300.0, .missing = 0.03, .extra = 0.05, .jitter_us = 20.0};
    const auto match =
        match_pulses(own.sees(pulses, seed + 1000), other.sees(pulses, seed + 2000), kTolerance);
    EXPECT_TRUE(match) << seed << ": " << match.error();
  }
}

TEST(PulseMatch, PulsesOfAnotherRecordingAreRefused) {
  const auto match = match_pulses(pulses_over(std::chrono::hours{2}, 20),
                                  pulses_over(std::chrono::hours{2}, 21), kTolerance);
  ASSERT_FALSE(match);
  EXPECT_TRUE(has(match.error(), "no place fits")) << match.error();
}

TEST(PulseMatch, RegularPulsesAreRefusedSinceSeveralPlacesFit) {
  Times regular;
  for (int i = 0; i < 500; ++i) regular.push_back(seconds{i});
  const auto match = match_pulses(regular, regular, kTolerance);
  ASSERT_FALSE(match);
  EXPECT_TRUE(has(match.error(), "irregular intervals")) << match.error();
  // A pattern that returns fits in two places.
  Times twice = pulses_over(seconds{60}, 22);
  const Times once = twice;
  for (const nanoseconds each : once) twice.push_back(each + seconds{61});
  const auto two = match_pulses(once, twice, kTolerance);
  ASSERT_FALSE(two);
  EXPECT_TRUE(has(two.error(), "two places fit")) << two.error();
}

TEST(PulseMatch, ARecorderThatWasStoppedAndStartedAgainIsRefused) {
  const Times pulses = pulses_over(std::chrono::minutes{40}, 23);
  Times paused;
  for (const nanoseconds each : pulses) {
    if (each < std::chrono::minutes{25}) paused.push_back(each);
    if (each > std::chrono::minutes{26}) paused.push_back(each - std::chrono::minutes{1});
  }
  const auto match = match_pulses(pulses, paused, kTolerance);
  ASSERT_FALSE(match);
  EXPECT_TRUE(has(match.error(), "stopped and started again")) << match.error();
}

TEST(PulseMatch, AClockOfAnotherRateIsRefusedAlsoWhereItsPulsesMatch) {
  const Times pulses = pulses_over(std::chrono::minutes{5}, 25);
  for (const double rate_ppm : {8000.0, -8000.0, 900.0}) {
    const Recorder other{.rate_ppm = rate_ppm};
    const auto match = match_pulses(pulses, other.sees(pulses, 26), kTolerance);
    EXPECT_EQ(match.has_value(), rate_ppm == 900.0);
    if (match) continue;
    EXPECT_TRUE(has(match.error(), "differ by 0.8 %")) << match.error();
  }
}

TEST(PulseMatch, TooFewPulsesAreRefused) {
  const Times few = {seconds{1}, seconds{2}};
  EXPECT_FALSE(match_pulses(few, pulses_over(seconds{60}, 24), kTolerance));
  EXPECT_FALSE(match_pulses({}, {}, kTolerance));
}

}  // namespace
}  // namespace merkel
