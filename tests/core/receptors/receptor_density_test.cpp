#include "core/receptors/receptor_density.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(ReceptorDensity, SolvesThePapersParametersToThePrintedDigits) {
  const auto density = ReceptorDensity::create({});
  ASSERT_TRUE(density);
  const double beta = density->density_per_mm2(1e6);
  const double sigma = density->sigma_mm();
  EXPECT_NEAR((density->density_per_mm2(0.0) - beta) * sigma * std::sqrt(2.0 * std::numbers::pi),
              37.17592397, 5e-9);  // alpha
  EXPECT_EQ(beta, 0.143);
  EXPECT_NEAR(sigma, 12.93029458, 5e-9);
}

TEST(ReceptorDensity, MeetsItsThreeConditionsForOtherParametersToo) {
  for (const auto& p : {ReceptorDensity::Parameters{0.5, 3.0, 0.0, 12.0},
                        ReceptorDensity::Parameters{1.2, 1.29, 0.143, 30.0},
                        ReceptorDensity::Parameters{0.15, 1.29, 0.143, 30.0}}) {
    const auto density = ReceptorDensity::create(p);
    ASSERT_TRUE(density);
    EXPECT_NEAR(density->density_per_mm2(0.0), p.max_per_mm2, 1e-12);
    EXPECT_NEAR(density->density_per_mm2(1e4), p.min_per_mm2, 1e-12);
    EXPECT_NEAR(density->cumulative_per_mm(p.length_mm) / p.length_mm, p.mean_per_mm2, 1e-12);
  }
}

TEST(ReceptorDensity, QuantileInvertsTheCumulativeDensity) {
  const auto density = ReceptorDensity::create({});
  ASSERT_TRUE(density);
  const double all = density->cumulative_per_mm(30.0);
  for (const double fraction : {0.0, 1e-9, 0.1, 0.5, 0.9, 1.0}) {
    EXPECT_NEAR(density->cumulative_per_mm(density->quantile_mm(fraction)), fraction * all, 1e-12);
  }
}

TEST(ReceptorDensity, RefusesAMeanOutsideItsLimits) {
  EXPECT_EQ(ReceptorDensity::create({.mean_per_mm2 = 1.3}).error().key,
            "receptors.density_per_mm2");
  EXPECT_EQ(ReceptorDensity::create({.mean_per_mm2 = 0.1}).error().key,
            "receptors.density_per_mm2");
  EXPECT_EQ(ReceptorDensity::create({.min_per_mm2 = -1.0}).error().key,
            "receptors.density_min_per_mm2");
  EXPECT_EQ(ReceptorDensity::create({.length_mm = 0.0}).error().key, "receptors.length_mm");
}

}  // namespace
}  // namespace merkel
