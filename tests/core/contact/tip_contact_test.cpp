#include "core/contact/tip_contact.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(TipContact, AFlatTipOnStiffeningSkinPressesWithTheForceItIsGiven) {
  for (const double radius_mm : {std::numeric_limits<double>::infinity(), 7.0}) {
    SkinParameters skin{.radius_mm = radius_mm};
    const Indenter indenter{.tip = PinTip{}, .control = Indenter::Control::kForce};
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

// E = E0(1 + p/p1) with the mean pressure p of the whole flat end.
TEST(TipContact, AFlatTipOnSkinThatStiffensWithThePressure) {
  const Indenter indenter{.tip = PinTip{}, .control = Indenter::Control::kForce};
  const TipContact soft(indenter, {});
  const TipContact tip(indenter, {.stiffening_kPa = 60.0});
  const double area_mm2 = tip.field()->force_mN(0.5) / tip.field()->mean_pressure_kPa(0.5);
  EXPECT_NEAR(area_mm2, 0.25 * std::numbers::pi, 1e-3);
  for (const double force_mN : {1.0, 50.0, 200.0}) {
    const Press press = tip.press({.force_mN = force_mN});
    const double stiffening = 1.0 + force_mN / area_mm2 / 60.0;
    EXPECT_NEAR(press.contact.stiffening, stiffening, 1e-3 * stiffening);
    EXPECT_NEAR(press.contact.force_mN, force_mN, 1e-6 * force_mN);
    EXPECT_NEAR(press.contact.depth_mm,
                soft.press({.force_mN = force_mN / stiffening}).contact.depth_mm, 1e-3);
  }
}

// A sphere solved on layers of the skin's own material has the pressure of the closed form.
TEST(TipContact, SolvedAndClosedFormsStiffenAlikeWithThePressure) {
  SkinParameters skin{.radius_mm = 7.0, .stiffening_kPa = 30.0};
  const Indenter sphere{.tip = SphereTip{5.0}, .control = Indenter::Control::kForce};
  const Press closed = TipContact(sphere, skin).press({.force_mN = 300.0});
  const double modulus_kPa = SkinMaterial(skin).youngs_modulus_kPa();
  skin.layers.count = 1;
  skin.layers.layer[0] = {
      .thickness_mm = 4.0, .youngs_modulus_kPa = modulus_kPa, .poisson_ratio = skin.poisson_ratio};
  skin.bone = false;
  const Press solved = TipContact(sphere, skin).press({.force_mN = 300.0});
  EXPECT_GT(closed.contact.stiffening, 1.5);
  // The solved area is that of whole pixels.
  EXPECT_NEAR(solved.contact.stiffening / closed.contact.stiffening, 1.0, 0.04);
  EXPECT_NEAR(solved.contact.depth_mm / closed.contact.depth_mm, 1.0, 0.03);
}

}  // namespace
}  // namespace merkel
