#include "core/contact/neighbour_depths.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace merkel {
namespace {

/// Spheres of 2 mm radius, 1 mm deep, evenly spaced in a row.
std::vector<NeighbourPress> row_of(std::size_t count, double apart_mm, const TipContact& tip) {
  std::vector<NeighbourPress> presses;
  for (std::size_t i = 0; i < count; ++i) {
    const ContactInput input{.depth_mm = 1.0, .x_mm = apart_mm * static_cast<double>(i)};
    presses.push_back({.tip = &tip, .input = input, .press = tip.press(input)});
  }
  return presses;
}

TEST(NeighbourDepths, TwoSpheresAreSofterThanEachAlone) {
  const TipContact tip(Indenter{}, {});
  const double alone = tip.press({.depth_mm = 1.0}).contact.force_mN;
  for (const auto& [apart_mm, stiffer] : {std::pair{4.0, 1.22}, std::pair{8.0, 1.11}}) {
    auto presses = row_of(2, apart_mm, tip);
    solve_neighbour_depths(presses);
    EXPECT_NEAR(alone / presses[0].press.contact.force_mN, stiffer, 0.01);
    EXPECT_NEAR(presses[0].press.contact.force_mN, presses[1].press.contact.force_mN, 1e-3);
    // Own indentation plus the displacement by the other sphere give the requested depth.
    const double own = presses[0].press.contact.depth_mm;
    const double other = tip.displacement_mm(presses[1].press, 0.0, 0.0);
    EXPECT_NEAR(own + other, 1.0, 1e-6);
  }
}

TEST(NeighbourDepths, AShallowTipLosesContact) {
  const TipContact tip(Indenter{}, {});
  auto presses = row_of(2, 2.5, tip);
  presses[1].input.depth_mm = 0.05;
  presses[1].press = tip.press(presses[1].input);
  solve_neighbour_depths(presses);
  EXPECT_FALSE(presses[1].press.touching());
  EXPECT_DOUBLE_EQ(presses[0].press.contact.depth_mm, 1.0);
}

TEST(NeighbourDepths, HandlesMixedTipsAndManyContacts) {
  const TipContact sphere(Indenter{}, {});
  const TipContact pin(Indenter{.tip = PinTip{.diameter_mm = 1.0}}, {});
  auto presses = row_of(7, 3.0, sphere);
  presses[3].tip = &pin;
  presses[3].press = pin.press(presses[3].input);
  solve_neighbour_depths(presses);
  for (const NeighbourPress& own : presses) {
    double found = own.press.contact.depth_mm;
    for (const NeighbourPress& other : presses) {
      if (&other == &own) continue;
      found += other.tip->displacement_mm(other.press, own.press.x_mm, own.press.y_mm);
    }
    EXPECT_NEAR(found, 1.0, 1e-5);
  }
}

}  // namespace
}  // namespace merkel
