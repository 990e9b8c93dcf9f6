#include "core/receptors/patch.hpp"

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(Patch, NumbersItsSubregionsAlongTheFingerFirst) {
  const Patch patch;
  EXPECT_EQ(patch.neuron_at(0.0, 0.0), 1U);
  EXPECT_EQ(patch.neuron_at(29.9, 0.0), 5U);
  EXPECT_EQ(patch.neuron_at(15.0, 9.99), 8U);
  EXPECT_EQ(patch.neuron_at(15.0, 10.0), 13U);
  EXPECT_EQ(patch.neuron_at(0.0, 19.9), 16U);
}

TEST(Patch, FarEdgesBelongToTheLastSubregions) { EXPECT_EQ(Patch{}.neuron_at(30.0, 20.0), 20U); }

TEST(Patch, CentresLieInTheirOwnSubregion) {
  const Patch patch;
  for (std::uint32_t n = 1; n <= 20; ++n) {
    EXPECT_EQ(patch.neuron_at(patch.centre_x_mm(n), patch.centre_y_mm(n)), n);
  }
  EXPECT_DOUBLE_EQ(patch.centre_x_mm(8), 15.0);
  EXPECT_DOUBLE_EQ(patch.centre_y_mm(8), 7.5);
}

TEST(Patch, RefusesAnEmptyGrid) {
  EXPECT_FALSE(Patch{.columns = 0}.check());
  EXPECT_FALSE(Patch{.length_mm = -1.0}.check());
}

}  // namespace
}  // namespace merkel
