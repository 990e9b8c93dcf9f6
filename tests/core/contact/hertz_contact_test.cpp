#include "core/contact/hertz_contact.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "core/skin/skin_material.hpp"
#include "tools/studies/reference/superposition.hpp"

namespace merkel {
namespace {

constexpr double kFlat = std::numeric_limits<double>::infinity();
const double kModulus_kPa = SkinMaterial(SkinParameters{}).reduced_modulus_kPa();

TEST(HertzContact, PaperPressHasThePublishedForceAndPressure) {
  const ContactState contact = HertzContact(2.0, kFlat, kModulus_kPa).at_depth(1.5);
  EXPECT_NEAR(contact.contact_radius_mm, std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(contact.force_mN, 453.45, 0.005);
  EXPECT_NEAR(contact.peak_pressure_kPa, 72.169, 0.0005);
}

TEST(HertzContact, ForceGrowsWithDepthToTheThreeHalves) {
  const HertzContact law(2.0, kFlat, kModulus_kPa);
  EXPECT_NEAR(law.at_depth(0.4).force_mN / law.at_depth(0.1).force_mN, 8.0, 1e-12);
}

TEST(HertzContact, PressureIntegratesToTheForce) {
  const HertzContact law(3.0, 8.0, kModulus_kPa);
  const ContactState contact = law.at_depth(0.7);
  const double force = reference::integrate(
      [&](double r) { return 2.0 * std::numbers::pi * r * HertzContact::pressure_kPa(contact, r); },
      0.0, contact.contact_radius_mm);
  EXPECT_NEAR(force / contact.force_mN, 1.0, 1e-10);
}

TEST(HertzContact, ForceInvertsToDepth) {
  const HertzContact law(5.0, 7.0, kModulus_kPa);
  for (const double depth : {1e-6, 0.01, 0.5, 1.5, 4.0}) {
    EXPECT_NEAR(law.at_force(law.at_depth(depth).force_mN).depth_mm / depth, 1.0, 1e-12);
  }
}

TEST(HertzContact, NoPressNoContact) {
  const HertzContact law(2.0, kFlat, kModulus_kPa);
  for (const double depth : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_FALSE(law.at_depth(depth).touching());
    EXPECT_FALSE(law.at_force(depth).touching());
  }
  EXPECT_EQ(HertzContact::surface_displacement_mm({}, 1.0), 0.0);
}

TEST(HertzContact, CurvedSkinActsAsASmallerSphere) {
  // a² = R*·d
  const auto radius_mm = [](double sphere_mm, double skin_mm) {
    return HertzContact(sphere_mm, skin_mm, kModulus_kPa).at_depth(1.0).contact_radius_mm;
  };
  EXPECT_DOUBLE_EQ(radius_mm(2.0, 2.0), 1.0);
  EXPECT_DOUBLE_EQ(radius_mm(kFlat, 7.0), std::sqrt(7.0));
}

TEST(HertzContact, SurfaceIsDisplacedByTheDepthAtTheCentre) {
  const HertzContact law(2.0, kFlat, kModulus_kPa);
  EXPECT_NEAR(HertzContact::surface_displacement_mm(law.at_depth(1.5), 0.0), 1.5, 1e-12);
}

TEST(HertzContact, SurfaceDisplacementIsContinuousInValueAndSlopeAtTheRim) {
  const HertzContact law(2.0, kFlat, kModulus_kPa);
  const ContactState contact = law.at_depth(1.5);
  const double a = contact.contact_radius_mm;
  const auto u = [&](double r) { return HertzContact::surface_displacement_mm(contact, r); };
  EXPECT_NEAR(u(a * (1.0 - 1e-12)), u(a), 1e-10);
  const double h = 1e-6;
  EXPECT_NEAR((u(a) - u(a - h)) / h, (u(a + h) - u(a)) / h, 1e-3);
}

TEST(HertzContact, SurfaceDisplacementEqualsTheSuperpositionOfPointLoads) {
  const HertzContact law(2.0, kFlat, kModulus_kPa);
  const ContactState contact = law.at_depth(1.5);
  for (const double r : {0.3, 1.0, 1.6, 2.0, 3.0, 10.0, 17.0, 25.0, 40.0, 60.0}) {
    const double expected = reference::superposed_displacement_mm(
        contact.peak_pressure_kPa, contact.contact_radius_mm, kModulus_kPa, r);
    EXPECT_NEAR(HertzContact::surface_displacement_mm(contact, r) / expected, 1.0, 1e-10)
        << "r = " << r;
  }
}

TEST(HertzContact, FarSeriesJoinsTheClosedForm) {
  const HertzContact law(2.0, kFlat, kModulus_kPa);
  const ContactState contact = law.at_depth(1.5);
  const double border = 20.0 * contact.contact_radius_mm;
  EXPECT_NEAR(HertzContact::surface_displacement_mm(contact, border * (1.0 - 1e-13)) /
                  HertzContact::surface_displacement_mm(contact, border * (1.0 + 1e-13)),
              1.0, 1e-11);
}

TEST(HertzContact, ThresholdRadiusOfTheDeepPressIsThePublishedOne) {
  const HertzContact law(2.0, kFlat, kModulus_kPa);
  EXPECT_NEAR(HertzContact::radius_of_displacement_mm(law.at_depth(1.5), 0.005), 220.5, 0.05);
}

TEST(HertzContact, ThresholdRadiusSeparatesDisplacedFromUndisplacedSkin) {
  const HertzContact law(2.0, kFlat, kModulus_kPa);
  const ContactState contact = law.at_depth(0.02);
  const double radius = HertzContact::radius_of_displacement_mm(contact, 0.005);
  EXPECT_GT(radius, 0.0);
  EXPECT_GE(HertzContact::surface_displacement_mm(contact, radius), 0.005);
  EXPECT_LT(HertzContact::surface_displacement_mm(contact, radius + 1e-5), 0.005);
  EXPECT_EQ(HertzContact::radius_of_displacement_mm(law.at_depth(0.004), 0.005), 0.0);
}

}  // namespace
}  // namespace merkel
