#include "realtime/loop/press_watch.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

namespace merkel {
namespace {

using std::chrono::milliseconds;

/// The deepest press of depths in mm, a tick of 1 ms each.
DeepestPress watch(const std::vector<double>& depths_mm) {
  PressWatch watch;
  double deepest_mm = 0.0;
  milliseconds begin{0};
  for (const double depth_mm : depths_mm) {
    deepest_mm = std::max(deepest_mm, depth_mm);
    watch.observe({.depth_mm = depth_mm}, depth_mm > 0.0, deepest_mm, begin,
                  begin + milliseconds{1});
    begin += milliseconds{1};
  }
  return watch.press();
}

TEST(PressWatch, TheRiseEndsWithinFivePercentOfTheDepth) {
  const DeepestPress press = watch({0.0, 0.5, 1.0, 1.02, 1.0, 0.0});
  EXPECT_EQ(press.input.depth_mm, 1.02);
  EXPECT_EQ(press.rise, milliseconds{2});
  EXPECT_EQ(press.touch, milliseconds{4});
}

TEST(PressWatch, TheRiseIsThatOfTheDeepestTouch) {
  // The second touch is deeper by 2 % and rises in one tick.
  const DeepestPress press = watch({0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 0.0, 1.02, 1.0, 0.0});
  EXPECT_EQ(press.input.depth_mm, 1.02);
  EXPECT_EQ(press.rise, milliseconds{1});
  EXPECT_EQ(press.touch, milliseconds{2});
}

TEST(PressWatch, TheRangeShowsSignOffsetAndFlicker) {
  PressWatch watch;
  milliseconds begin{0};
  const auto force = [&](double force_mN) {
    watch.observe({.force_mN = force_mN}, force_mN > 0.0, 0.0, begin, begin + milliseconds{1});
    begin += milliseconds{1};
  };
  for (const double force_mN : {-590.0, 0.3, -0.3, 0.3, 0.0}) force(force_mN);
  EXPECT_EQ(watch.range().least_force_mN, -590.0);
  EXPECT_EQ(watch.range().most_force_mN, 0.3);
  EXPECT_EQ(watch.range().brief_touches, 2U);
  for (int k = 0; k < 50; ++k) force(k == 20 ? 12.0 : 40.0);
  force(0.0);
  EXPECT_EQ(watch.range().longest_touch, milliseconds{50});
  EXPECT_EQ(watch.range().least_force_of_longest_mN, 12.0);
  EXPECT_EQ(watch.range().brief_touches, 2U);
}

}  // namespace
}  // namespace merkel
