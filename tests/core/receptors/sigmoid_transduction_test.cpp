#include "core/receptors/sigmoid_transduction.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(SigmoidTransduction, IsHalfItsMaximumAtLambda) {
  EXPECT_DOUBLE_EQ(SigmoidTransduction{}.current_uA_per_cm2(0.10), 0.5);
}

TEST(SigmoidTransduction, AgreesWithThePrintedFormWhereItDoesNotOverflow) {
  const SigmoidTransduction s{.alpha_uA_per_cm2 = 2.0, .lambda_kPa = 0.2, .gamma_per_kPa = 30.0};
  for (const double sed : {0.0, 0.05, 0.2, 0.3, 1.0}) {
    EXPECT_NEAR(s.current_uA_per_cm2(sed), 2.0 / (1.0 + std::exp(30.0 * (0.2 - sed))), 1e-15);
  }
}

TEST(SigmoidTransduction, SaturatesWithoutOverflow) {
  const SigmoidTransduction s{.lambda_kPa = 0.0, .gamma_per_kPa = 1.0};
  EXPECT_EQ(s.current_uA_per_cm2(1000.0), 1.0);
  EXPECT_EQ(s.current_uA_per_cm2(-1000.0), 0.0);
  EXPECT_EQ(s.current_uA_per_cm2(1e308), 1.0);
  EXPECT_EQ(s.current_uA_per_cm2(-1e308), 0.0);
}

TEST(SigmoidTransduction, SaturatesInBothPrecisions) {
  for (const double x : {1000.0, 1e308, 1e30}) {
    EXPECT_EQ(logistic(x), 1.0);
    EXPECT_EQ(logistic(-x), 0.0);
    EXPECT_EQ(logistic(static_cast<float>(std::min(x, 3e38))), 1.0F);
    EXPECT_EQ(logistic(static_cast<float>(-std::min(x, 3e38))), 0.0F);
  }
  EXPECT_FLOAT_EQ(logistic(0.5F), 0.62245933F);
}

TEST(SigmoidTransduction, RefusesAZeroSlope) {
  EXPECT_EQ((SigmoidTransduction{.gamma_per_kPa = 0.0}.check().error().key),
            "transduction.gamma_per_kPa");
}

}  // namespace
}  // namespace merkel
