#include "core/receptors/adaptation.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr AdaptationParameters kParameters{
    .gain_Hz_per_kPa = 18.1, .fast_weight = 57.0, .slow_weight = 1.54};

double drive_after(Adaptation& afferent, double begin, double end,
                   std::chrono::nanoseconds interval) {
  double drive = 0.0;
  afferent.advance({&begin, 1}, {&end, 1}, interval, {&drive, 1});
  return drive;
}

TEST(Adaptation, AnswersAStepAsTheEquationsSay) {
  Adaptation afferent(kParameters, 1);
  for (int k = 1; k <= 4000; ++k) {
    const double drive = drive_after(afferent, 2.0, 2.0, milliseconds{1});
    const double u = 18.1 * 2.0;
    const double expected = u * (1.0 + 57.0 * std::exp(-k / 8.0) + 1.54 * std::exp(-k / 1832.0));
    ASSERT_NEAR(drive, expected, 1e-9 * expected) << k;
  }
}

TEST(Adaptation, AnswersARampExactlyAtAnyInterval) {
  // x of a ramp u = c·t is c·(t − τ + τ·e^{−t/τ}).
  const auto expected = [](double t_ms) {
    const auto x = [t_ms](double tau) { return t_ms - tau + tau * std::exp(-t_ms / tau); };
    return 18.1 * 0.05 * ((1.0 + 57.0 + 1.54) * t_ms - 57.0 * x(8.0) - 1.54 * x(1832.0));
  };
  for (const int interval_us : {125, 1000, 10'000, 40'000}) {
    Adaptation afferent(kParameters, 1);
    double drive = 0.0;
    for (int k = 1; k * interval_us <= 40'000; ++k) {
      drive = drive_after(afferent, 0.05e-3 * (k - 1) * interval_us, 0.05e-3 * k * interval_us,
                          microseconds{interval_us});
    }
    EXPECT_NEAR(drive, expected(40.0), 1e-9 * expected(40.0)) << interval_us;
  }
}

TEST(Adaptation, NeverDrivesNegatively) {
  Adaptation afferent(kParameters, 1);
  EXPECT_GT(drive_after(afferent, 3.0, 3.0, milliseconds{500}), 0.0);
  EXPECT_EQ(drive_after(afferent, 3.0, 0.0, milliseconds{1}), 0.0);
  EXPECT_EQ(drive_after(afferent, 0.0, 0.0, milliseconds{100}), 0.0);
}

TEST(Adaptation, ResetForgets) {
  Adaptation afferent(kParameters, 1);
  const double fresh = drive_after(afferent, 0.0, 1.0, milliseconds{1});
  EXPECT_LT(drive_after(afferent, 1.0, 1.0, milliseconds{900}), fresh);
  afferent.reset();
  EXPECT_EQ(drive_after(afferent, 0.0, 1.0, milliseconds{1}), fresh);
}

TEST(Adaptation, GainsSpreadAsAskedAndAsSeeded) {
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

TEST(Adaptation, NamesTheParameterThatCannotBe) {
  EXPECT_EQ((AdaptationParameters{.gain_Hz_per_kPa = -1.0}).check().error().key,
            "afferent.gain_Hz_per_kPa");
  EXPECT_EQ((AdaptationParameters{.fast_ms = 0.0}).check().error().key, "afferent.fast_ms");
  EXPECT_EQ((AdaptationParameters{.gain_spread = 3.0}).check().error().key, "afferent.gain_spread");
}

}  // namespace
}  // namespace merkel
