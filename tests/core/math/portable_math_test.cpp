#include "core/math/portable_math.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(PortableMath, ExponentialAgreesWithTheLibrary) {
  for (double x = -40.0; x <= 40.0; x += 0.0137) {
    EXPECT_NEAR(portable_exp(x) / std::exp(x), 1.0, 1e-14) << x;
  }
}

TEST(PortableMath, ExponentialOfHugeArgumentsIsZeroOrInfinite) {
  for (const double x : {747.0, 1e10, 1e300}) {
    EXPECT_EQ(portable_exp(-x), 0.0);
    EXPECT_TRUE(std::isinf(portable_exp(x)));
  }
}

TEST(PortableMath, Expm1KeepsItsDigits) {
  for (double x = 1e-300; x < 40.0; x = x * 1.7 + 1e-18) {
    for (const double y : {x, -x}) EXPECT_NEAR(portable_expm1(y) / std::expm1(y), 1.0, 1e-14) << y;
  }
}

TEST(PortableMath, ErrorFunctionAgreesWithTheLibrary) {
  for (double x = -7.0; x <= 7.0; x += 0.00713) {
    EXPECT_NEAR(portable_erf(x), std::erf(x), 1e-14) << x;
  }
  EXPECT_EQ(portable_erf(0.0), 0.0);
}

}  // namespace
}  // namespace merkel
