#include "core/parameters/parameter_error.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(ParameterCheck, KeepsTheFirstFailure) {
  const auto result =
      ParameterCheck().positive("a", 1.0).positive("b", -2.0).positive("c", -3.0).result();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().key, "b");
  EXPECT_EQ(result.error().reason, "must be a positive number, but is -2");
}

TEST(ParameterCheck, RefusesNotANumberEverywhere) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(ParameterCheck().positive("k", kNan).result());
  EXPECT_FALSE(ParameterCheck().positive_or_infinite("k", kNan).result());
  EXPECT_FALSE(ParameterCheck().not_negative("k", kNan).result());
  EXPECT_FALSE(ParameterCheck().finite("k", kNan).result());
  EXPECT_FALSE(ParameterCheck().in_range("k", kNan, 0.0, 1.0).result());
}

TEST(ParameterCheck, TakesOverANestedCheck) {
  const auto nested = ParameterCheck().whole_in_range("inner", 7, 0, 5).result();
  EXPECT_EQ(ParameterCheck().also(nested).result().error().key, "inner");
}

}  // namespace
}  // namespace merkel
