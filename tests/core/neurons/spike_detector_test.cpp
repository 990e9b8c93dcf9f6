#include "core/neurons/spike_detector.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(SpikeDetector, OnlyAnUpwardCrossingIsASpike) {
  EXPECT_TRUE(crosses_upward(-21.0, -19.0, -20.0));
  EXPECT_TRUE(crosses_upward(-21.0, -20.0, -20.0));
  EXPECT_FALSE(crosses_upward(-20.0, -19.0, -20.0));
  EXPECT_FALSE(crosses_upward(-19.0, -21.0, -20.0));
  EXPECT_FALSE(crosses_upward(std::nan(""), -19.0, -20.0));
}

TEST(SpikeDetector, LinearCrossingIsExactForALine) {
  EXPECT_DOUBLE_EQ(linear_crossing(-30.0, 10.0, -20.0), 0.25);
}

TEST(SpikeDetector, HermiteCrossingIsExactForACubic) {
  // V(x) = −40 + 5x + 10x² + 30x³ on [0, 1] crosses −20 where 5x + 10x² + 30x³ = 20.
  const double crossing = hermite_crossing(-40.0, 5.0, 5.0, 115.0, -20.0);
  EXPECT_NEAR(5.0 * crossing + 10.0 * crossing * crossing + 30.0 * std::pow(crossing, 3), 20.0,
              1e-9);
}

}  // namespace
}  // namespace merkel
