#include "core/contact/tip_contact.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(TipContact, AFlatTipOnStiffeningSkinPressesWithTheForceItIsGiven) {
  for (const double radius_mm : {std::numeric_limits<double>::infinity(), 7.0}) {
    SkinParameters skin{.radius_mm = radius_mm};
    const Indenter indenter{.tip = Indenter::Tip::kPin, .control = Indenter::Control::kForce};
    const TipContact soft(indenter, skin);
    skin.stiffening_mm = 0.8;
    const TipContact tip(indenter, skin);
    for (const double force_mN : {1.0, 50.0, 400.0}) {
      const Press press = tip.press({.force_mN = force_mN});
      const double depth_mm = press.contact.depth_mm;
      EXPECT_NEAR(press.contact.stiffening, std::exp(depth_mm / 0.8), 1e-12);
      EXPECT_NEAR(press.contact.force_mN, force_mN, 1e-9 * force_mN);
      // The same depth in skin at rest takes less force, by the stiffening.
      EXPECT_NEAR(soft.press_at_depth({}, depth_mm).contact.force_mN,
                  force_mN / press.contact.stiffening, 1e-9 * force_mN);
      EXPECT_LT(depth_mm, soft.press({.force_mN = force_mN}).contact.depth_mm);
    }
    EXPECT_FALSE(tip.press({.force_mN = 0.0}).touching());
  }
}

}  // namespace
}  // namespace merkel
