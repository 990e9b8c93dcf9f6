#include "core/parameters/parameter_error.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(ParameterCheck, KeepsTheFirstFailure) {
  const auto result = ParameterCheck()
                          .number("a", 1.0, positive(9))
                          .number("b", -2.0, positive(9))
                          .number("c", -3.0, positive(9))
                          .result();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().key, "b");
  EXPECT_EQ(result.error().reason, "must be a positive number, but is -2");
}

TEST(ParameterCheck, RefusesNaNEverywhere) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(ParameterCheck().number("k", kNan, positive(1)).result());
  EXPECT_FALSE(ParameterCheck().number("k", kNan, positive_or_infinite(1)).result());
  EXPECT_FALSE(ParameterCheck().number("k", kNan, not_negative(1)).result());
  EXPECT_FALSE(ParameterCheck().number("k", kNan, from_to(-1, 1)).result());
  EXPECT_FALSE(ParameterCheck().number("k", kNan, from_below(0.0, 1.0)).result());
}

TEST(ParameterCheck, IncludesANestedCheck) {
  const auto nested = ParameterCheck().number("inner", 7, from_to(0, 5)).result();
  EXPECT_EQ(ParameterCheck().also(nested).result().error().key, "inner");
}

}  // namespace
}  // namespace merkel
