#include "drivers/sample_limits.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(SampleLimits, NonFiniteAndImpossibleReadingsAreImplausible) {
  EXPECT_TRUE(plausible(ProbeSample{.depth_mm = 1.5, .force_mN = 450.0}));
  EXPECT_FALSE(plausible(ProbeSample{.depth_mm = std::nan("")}));
  EXPECT_FALSE(plausible(ProbeSample{.force_mN = HUGE_VAL}));
  EXPECT_FALSE(plausible(ProbeSample{.x_mm = -1e9}));
  EXPECT_FALSE(plausible(ProbeSample{.depth_mm = 1e6}));
}

}  // namespace
}  // namespace merkel
