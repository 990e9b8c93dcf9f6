// Guarantees that the arithmetic of a release build must keep.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(Arithmetic, NansAndInfinitiesArePreserved) {
  volatile double zero = 0.0;
  const double nan = zero / zero;
  EXPECT_TRUE(std::isnan(nan));
  EXPECT_FALSE(nan == nan);
  EXPECT_FALSE(std::isfinite(1.0 / zero));
}

TEST(Arithmetic, SubnormalNumbersAreNotFlushedToZero) {
  volatile double least = std::numeric_limits<double>::min();
  EXPECT_GT(least / 4.0, 0.0);
  volatile float least_float = std::numeric_limits<float>::min();
  EXPECT_GT(least_float / 4.0F, 0.0F);
}

TEST(Arithmetic, SumsAreNotReordered) {
  volatile double large = 1e16;
  volatile double small = 1.0;
  EXPECT_EQ((large + small) - large, 0.0);
}

}  // namespace
}  // namespace merkel
