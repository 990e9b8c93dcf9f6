#include "core/math/line_fit.hpp"

#include <array>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(LineFit, IsExactForPointsOnALineFarFromZero) {
  const std::array x = {1000.0, 1001.0, 1004.0};
  const std::array y = {-3.0, -1.0, 5.0};
  const FittedLine line = fit_line(x, y);
  EXPECT_NEAR(line.slope, 2.0, 1e-12);
  EXPECT_NEAR(line.intercept, -2003.0, 1e-9);
}

// By hand: means 3 and 4, Σ(x − 3)(y − 4) = 7, Σ(x − 3)² = 14.
TEST(LineFit, LeavesTheSmallestSquares) {
  const std::array x = {1.0, 2.0, 6.0};
  const std::array y = {1.0, 6.0, 5.0};
  const FittedLine line = fit_line(x, y);
  EXPECT_DOUBLE_EQ(line.slope, 0.5);
  EXPECT_DOUBLE_EQ(line.intercept, 2.5);
}

}  // namespace
}  // namespace merkel
