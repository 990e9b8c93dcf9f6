#include "core/receptors/adaptation.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr AdaptationParameters kParameters{.gain_Hz_per_kPa = 18.1};

double drive_after(Adaptation& afferent, double begin, double end,
                   std::chrono::nanoseconds interval) {
  double drive = 0.0;
  afferent.advance({&begin, 1}, {&end, 1}, interval, {&drive, 1});
  return drive;
}

/// The drive of an energy density over time, from the equations in steps of 1 µs.
double by_euler(const AdaptationParameters& p, double t_ms, double (*energy)(double)) {
  double x1 = 0.0;
  double x3 = 0.0;
  double drive = 0.0;
  constexpr double kStep_ms = 1e-3;
  const auto steps = static_cast<int>(std::lround(t_ms / kStep_ms));
  for (int k = 1; k <= steps; ++k) {
    const double u = p.gain_Hz_per_kPa * energy(k * kStep_ms);
    x1 += kStep_ms * (u - x1) / p.fast_ms;
    const double felt = std::max(0.0, (1.0 + p.fast_weight) * u - p.fast_weight * x1);
    const double R = felt / (1.0 + 1e-3 * p.compression_ms * felt);
    x3 += kStep_ms * (R - x3) / p.slow_ms;
    drive = std::max(0.0, (1.0 + p.slow_weight) * R - p.slow_weight * x3);
  }
  return drive;
}

TEST(Adaptation, FollowsTheEquations) {
  const auto ramp_and_hold = [](double t_ms) { return 2.0 * std::min(1.0, t_ms / 50.0); };
  for (const int interval_us : {500, 1000}) {
    Adaptation afferent(kParameters, 1);
    int k = 0;
    for (const double t_ms : {10.0, 50.0, 60.0, 300.0, 2000.0}) {
      double drive = 0.0;
      while (1e-3 * interval_us * k < t_ms - 1e-9) {
        const double begin = ramp_and_hold(1e-3 * interval_us * k);
        const double end = ramp_and_hold(1e-3 * interval_us * ++k);
        drive = drive_after(afferent, begin, end, microseconds{interval_us});
      }
      const double expected = by_euler(kParameters, t_ms, ramp_and_hold);
      EXPECT_NEAR(drive, expected, 2e-3 * expected) << t_ms << " " << interval_us;
    }
  }
}

TEST(Adaptation, FastAdaptationIsExactAtAnyInterval) {
  // x of a ramp u = c·t is c·(t − τ + τ·e^{−t/τ}).
  AdaptationParameters fast = kParameters;
  fast.slow_weight = 0.0;
  fast.compression_ms = 0.0;
  const double x = 40.0 - fast.fast_ms + fast.fast_ms * std::exp(-40.0 / fast.fast_ms);
  const double expected =
      fast.gain_Hz_per_kPa * 0.05 * ((1.0 + fast.fast_weight) * 40.0 - fast.fast_weight * x);
  for (const int interval_us : {125, 1000, 10'000, 40'000}) {
    Adaptation afferent(fast, 1);
    double drive = 0.0;
    for (int k = 1; k * interval_us <= 40'000; ++k) {
      drive = drive_after(afferent, 0.05e-3 * (k - 1) * interval_us, 0.05e-3 * k * interval_us,
                          microseconds{interval_us});
    }
    EXPECT_NEAR(drive, expected, 1e-9 * expected) << interval_us;
  }
}

// Recorded holds of 0.65 and 1.3 mm adapt by nearly the same fraction.
TEST(Adaptation, AHoldAdaptsByTheSameFractionAtAnyDepth) {
  const auto share_left = [](double energy) {
    Adaptation afferent(kParameters, 1);
    double early = 0.0;
    double drive = 0.0;
    for (int k = 0; k < 12'000; ++k) {
      drive = drive_after(afferent, energy, energy, milliseconds{1});
      if (k == 50) early = drive;
    }
    return drive / early;
  };
  EXPECT_NEAR(share_left(1.0), share_left(8.0), 0.01);
  EXPECT_LT(share_left(8.0), 0.7);
}

TEST(Adaptation, KnowsWhenItIsAtRest) {
  Adaptation afferent(kParameters, 1);
  EXPECT_TRUE(afferent.at_rest());
  drive_after(afferent, 0.0, 0.0, milliseconds{1});
  EXPECT_TRUE(afferent.at_rest());
  drive_after(afferent, 0.0, 1.0, milliseconds{1});
  EXPECT_FALSE(afferent.at_rest());
  for (int k = 0; k < 120'000; ++k) drive_after(afferent, 0.0, 0.0, milliseconds{1});
  EXPECT_TRUE(afferent.at_rest());
}

TEST(Adaptation, DriveIsNeverNegative) {
  Adaptation afferent(kParameters, 1);
  EXPECT_GT(drive_after(afferent, 3.0, 3.0, milliseconds{500}), 0.0);
  EXPECT_EQ(drive_after(afferent, 3.0, 0.0, milliseconds{1}), 0.0);
  EXPECT_EQ(drive_after(afferent, 0.0, 0.0, milliseconds{100}), 0.0);
}

TEST(Adaptation, ResetClearsTheState) {
  Adaptation afferent(kParameters, 1);
  const double fresh = drive_after(afferent, 0.0, 1.0, milliseconds{1});
  EXPECT_LT(drive_after(afferent, 1.0, 1.0, milliseconds{900}), fresh);
  afferent.reset();
  EXPECT_EQ(drive_after(afferent, 0.0, 1.0, milliseconds{1}), fresh);
}

TEST(Adaptation, GainsFollowTheSpreadAndTheSeed) {
  AdaptationParameters parameters = kParameters;
  EXPECT_EQ(Adaptation(parameters, 3).gains()[2], 18.1);
  parameters.gain_spread = 0.3;
  const Adaptation afferents(parameters, 2000);
  double sum = 0.0;
  double sum2 = 0.0;
  for (const double gain : afferents.gains()) {
    const double z = std::log(gain / 18.1) / 0.3;
    sum += z;
    sum2 += z * z;
  }
  EXPECT_NEAR(sum / 2000.0, 0.0, 0.1);
  EXPECT_NEAR(sum2 / 2000.0, 1.0, 0.15);
  EXPECT_EQ(Adaptation(parameters, 2000).gains()[7], afferents.gains()[7]);
  parameters.seed = 2;
  EXPECT_NE(Adaptation(parameters, 2000).gains()[7], afferents.gains()[7]);
}

TEST(Adaptation, NamesTheInvalidParameter) {
  EXPECT_EQ((AdaptationParameters{.gain_Hz_per_kPa = -1.0}).check().error().key,
            "afferent.gain_Hz_per_kPa");
  EXPECT_EQ((AdaptationParameters{.fast_ms = 0.0}).check().error().key, "afferent.fast_ms");
  EXPECT_EQ((AdaptationParameters{.gain_spread = 3.0}).check().error().key, "afferent.gain_spread");
}

}  // namespace
}  // namespace merkel
