#include "core/math/line_fit.hpp"

#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace merkel {
namespace {

using Pair = std::pair<double, double>;

TEST(LineFit, IsExactForPointsOnALineFarFromZero) {
  const FittedLine line =
      fit_line(std::vector<Pair>{{1000.0, -3.0}, {1001.0, -1.0}, {1004.0, 5.0}});
  EXPECT_NEAR(line.slope(), 2.0, 1e-12);
  EXPECT_NEAR(line.intercept(), -2003.0, 1e-9);
}

// By hand: means 3 and 4, Σ(x − 3)(y − 4) = 7, Σ(x − 3)² = 14.
TEST(LineFit, LeavesTheSmallestSquares) {
  const FittedLine line = fit_line(std::vector<Pair>{{1.0, 1.0}, {2.0, 6.0}, {6.0, 5.0}});
  EXPECT_DOUBLE_EQ(line.slope(), 0.5);
  EXPECT_DOUBLE_EQ(line.intercept(), 2.5);
  EXPECT_DOUBLE_EQ(line.at(4.0), 4.5);
}

TEST(LineFit, CountsAPointAsOftenAsItsWeight) {
  const std::vector<Pair> with_one_twice = {{1.0, 1.0}, {2.0, 6.0}, {2.0, 6.0}, {6.0, 5.0}};
  const std::vector<Pair> once = {{1.0, 1.0}, {2.0, 6.0}, {6.0, 5.0}};
  const FittedLine repeated = fit_line(with_one_twice);
  const FittedLine weighted = fit_line(
      once, [](const Pair& pair) { return pair.first; },
      [](const Pair& pair) { return pair.second; },
      [](const Pair& pair) { return pair.first == 2.0 ? 2.0 : 1.0; });
  EXPECT_DOUBLE_EQ(weighted.slope(), repeated.slope());
  EXPECT_DOUBLE_EQ(weighted.intercept(), repeated.intercept());
}

TEST(LineFit, OfEqualXIsLevelAtTheMean) {
  const FittedLine line = fit_line(std::vector<Pair>{{2.0, 1.0}, {2.0, 4.0}});
  EXPECT_EQ(line.slope(), 0.0);
  EXPECT_DOUBLE_EQ(line.intercept(), 2.5);
}

}  // namespace
}  // namespace merkel
