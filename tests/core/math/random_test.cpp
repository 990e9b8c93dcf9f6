#include "core/math/random.hpp"

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(Random, GivesThePublishedSequenceOfSplitMix64) {
  Random random(1234567);
  EXPECT_EQ(random.next(), 6457827717110365317U);
  EXPECT_EQ(random.next(), 3203168211198807973U);
  EXPECT_EQ(random.next(), 9817491932198370423U);
}

TEST(Random, UniformNumbersFillTheirRangeEvenly) {
  Random random(7);
  double sum = 0.0;
  double sum2 = 0.0;
  constexpr int kDraws = 100'000;
  for (int k = 0; k < kDraws; ++k) {
    const double x = random.uniform(-1.0, 3.0);
    ASSERT_GE(x, -1.0);
    ASSERT_LT(x, 3.0);
    sum += x;
    sum2 += x * x;
  }
  const double mean = sum / kDraws;
  EXPECT_NEAR(mean, 1.0, 0.02);
  EXPECT_NEAR(sum2 / kDraws - mean * mean, 16.0 / 12.0, 0.02);
}

}  // namespace
}  // namespace merkel
