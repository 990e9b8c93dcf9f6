#include "core/math/decay.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(Decay, MatchesTheExponentialToTheLastDigits) {
  EXPECT_EQ(decay(0.0), 1.0);
  for (int k = 0; k < 200'000; ++k) {
    const double x = k * 0.0035;
    EXPECT_NEAR(decay(x), std::exp(-x), 1e-15 * std::exp(-x)) << x;
  }
}

TEST(Decay, EndsAtZero) {
  EXPECT_EQ(decay(700.0), 0.0);
  EXPECT_EQ(decay(std::numeric_limits<double>::infinity()), 0.0);
}

}  // namespace
}  // namespace merkel
