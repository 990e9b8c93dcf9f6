#include "core/contact/contact_validity.hpp"

#include <gtest/gtest.h>

#include "core/contact/sphere_law.hpp"

namespace merkel {
namespace {

ContactValidity validity(const SkinParameters& skin, double radius_mm, double depth_mm) {
  return validity_of(SphereLaw(skin, radius_mm).at_depth(depth_mm), skin, radius_mm);
}

TEST(ContactValidity, ShallowPressesAreWithinAndDeepOnesAreNot) {
  EXPECT_TRUE(validity({}, 2.0, 0.05).within);
  EXPECT_FALSE(validity({}, 2.0, 1.5).within);
}

TEST(ContactValidity, DependsOnEveryReportedRatio) {
  // A shallow press of a large sphere strains the skin little, but the bone stiffens it.
  const ContactValidity wide = validity({}, 100.0, 0.5);
  EXPECT_LT(wide.radius_ratio, ContactValidity::kLargestRadiusRatio);
  EXPECT_NEAR(wide.layer_force_error, -0.907, 0.001);
  EXPECT_FALSE(wide.within);
}

TEST(ContactValidity, ReportsTheForceErrorAgainstAnExactSphere) {
  const ContactValidity found = validity({}, 1.0, 0.3);
  EXPECT_NEAR(found.sphere_force_error, 1.0 / 0.970 - 1.0, 5e-4);
  EXPECT_NE(found.sentence().find("3.1 % above that of an exact sphere"), std::string::npos);
}

TEST(ContactValidity, ReportsTheEffectOfBone) {
  const ContactValidity half_space = validity({}, 2.0, 1.5);
  EXPECT_NEAR(half_space.layer_ratio, 0.433, 5e-4);
  EXPECT_NEAR(1.0 / (1.0 + half_space.layer_force_error), 1.85, 0.005);
  EXPECT_EQ(
      half_space.sentence(),
      "Hertz, whose force is 8.1 % above that of an exact sphere (a/R = 0.866, limit 0.3: "
      "[skin] contact_law = \"sneddon\" solves the exact one); on a half-space: with bone at 4 "
      "mm, the force would be 1.85 times as large (√(Rd)/h = 0.433, limit 0.1: [skin] "
      "thickness_mm = 4 solves it)");
}

TEST(ContactValidity, AFlatPlateUsesTheRadiusOfTheFinger) {
  const SkinParameters finger{.radius_mm = 7.0};
  const double plate = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(validity(finger, plate, 0.7).radius_ratio, std::sqrt(0.1), 1e-9);
}

}  // namespace
}  // namespace merkel
