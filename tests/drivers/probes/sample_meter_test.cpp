#include "drivers/probes/sample_meter.hpp"

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// Samples at a steady rate, late by up to some jitter.
class Stream {
 public:
  explicit Stream(SampleMeter& meter) : meter_(meter) {}
  /// Returns how often the timing changed.
  int run(double period_ms, double jitter_ms, double seconds) {
    int changes = 0;
    for (double t = 0.0; t < 1e3 * seconds; t += period_ms) {
      time_ += units::nanoseconds_from_ms(period_ms);
      const nanoseconds late = units::nanoseconds_from_ms(0.1 + jitter_ms * random_.uniform());
      if (meter_.add({.time = time_, .arrival = time_ + late})) ++changes;
    }
    return changes;
  }
  void silence(double ms) { time_ += units::nanoseconds_from_ms(ms); }

 private:
  SampleMeter& meter_;
  Random random_{3};
  nanoseconds time_{0};
};

TEST(SampleMeter, DelayIsOnePeriodAndTheJitter) {
  for (const double period_ms : {1.0, 4.0, 10.0, 40.0, 100.0}) {
    SampleMeter meter;
    Stream stream(meter);
    EXPECT_EQ(stream.run(period_ms, 0.5, 1.3), 1) << period_ms;
    ASSERT_TRUE(meter.timing());
    EXPECT_NEAR(units::ms_from(meter.timing()->period), period_ms, 0.01);
    EXPECT_LE(units::ms_from(meter.timing()->delay), period_ms + 0.75);
    EXPECT_GE(units::ms_from(meter.timing()->delay), period_ms + 0.3);
    EXPECT_LE(units::ms_from(meter.timing()->delay_of_newest), 0.75);
    EXPECT_GE(units::ms_from(meter.timing()->delay_of_newest), 0.3);
    EXPECT_GE(meter.timing()->stale_after, milliseconds{50});
    EXPECT_GE(meter.timing()->stale_after, 3 * meter.timing()->period);
  }
}

TEST(SampleMeter, AnOutageIsNoJitter) {
  SampleMeter meter;
  Stream stream(meter);
  stream.run(1.0, 0.2, 1.5);
  const auto before = *meter.timing();
  stream.silence(3000.0);
  EXPECT_EQ(stream.run(1.0, 0.2, 3.0), 0);
  EXPECT_EQ(meter.timing()->delay, before.delay);
}

TEST(SampleMeter, FollowsAnotherRate) {
  SampleMeter meter;
  Stream stream(meter);
  stream.run(10.0, 0.2, 1.5);
  EXPECT_GE(stream.run(2.0, 0.2, 5.0), 1);
  EXPECT_NEAR(units::ms_from(meter.timing()->delay), 2.4, 0.3);
  EXPECT_GE(stream.run(200.0, 0.2, 5.0), 1);
  EXPECT_NEAR(units::ms_from(meter.timing()->delay), 200.4, 0.5);
  EXPECT_GE(meter.timing()->stale_after, milliseconds{600});
}

TEST(SampleMeter, OneBadSecondChangesNothingLastingJitterDoes) {
  SampleMeter meter;
  Stream stream(meter);
  stream.run(1.0, 0.2, 3.2);
  EXPECT_EQ(stream.run(1.0, 8.0, 0.9), 0);
  EXPECT_EQ(stream.run(1.0, 0.2, 3.0), 0);
  EXPECT_EQ(stream.run(1.0, 8.0, 4.5), 1);
  EXPECT_GT(units::ms_from(meter.timing()->delay), 8.0);
  EXPECT_GE(stream.run(1.0, 0.2, 6.0), 1);
  EXPECT_LT(units::ms_from(meter.timing()->delay), 2.0);
}

TEST(SampleMeter, ABadFirstSecondIsForgotten) {
  SampleMeter meter;
  Stream stream(meter);
  stream.run(1.0, 400.0, 1.5);
  EXPECT_GT(units::ms_from(meter.timing()->delay), 100.0);
  stream.run(1.0, 0.2, 3.0);
  EXPECT_LT(units::ms_from(meter.timing()->delay), 2.0);
  EXPECT_EQ(meter.timing()->stale_after, milliseconds{50});
}

TEST(SampleMeter, BurstsDoNotProlongASilence) {
  // 1000 samples a second, sent every half second: the loop waits for 50 ms at most.
  SampleMeter meter;
  for (int k = 0; k < 4000; ++k) {
    meter.add({.time = milliseconds{k}, .arrival = milliseconds{500 * (k / 500 + 1)}});
  }
  ASSERT_TRUE(meter.timing());
  EXPECT_GT(meter.timing()->delay, milliseconds{400});
  EXPECT_EQ(meter.timing()->stale_after, milliseconds{150});
}

TEST(SampleMeter, AShortStreamIsMeasuredAtItsEnd) {
  SampleMeter meter;
  Stream stream(meter);
  EXPECT_EQ(stream.run(10.0, 0.2, 0.2), 0);
  EXPECT_FALSE(meter.timing());
  EXPECT_TRUE(meter.finish());
  EXPECT_NEAR(units::ms_from(meter.timing()->period), 10.0, 0.01);
}

}  // namespace
}  // namespace merkel
