#include "core/contact/sphere_law.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tools/studies/reference/bonded_layer.hpp"
#include "tools/studies/reference/superposition.hpp"

namespace merkel {
namespace {

using reference::BondedLayer;

constexpr double kNu = 0.48;

// Perturbation for thick layers, with the kernel taken as constant over the contact:
// F/F_Hertz = 1 + 3k/2·χ + 21k²/8·χ² + O(χ³), k = 4m/(3π), m = ∫₀^∞ (1−K(x)) dx.
TEST(BondedLayer, AgreesWithThePerturbationOfAThickLayer) {
  for (const double nu : {0.0, 0.3, 0.48}) {
    const double kappa = 3.0 - 4.0 * nu;
    const double m = reference::integrate(
        [kappa](double x) {
          return 1.0 - (2.0 * kappa * std::sinh(2.0 * x) - 4.0 * x) /
                           (2.0 * kappa * std::cosh(2.0 * x) + kappa * kappa + 1.0 + 4.0 * x * x);
        },
        0.0, 40.0);
    const double k = 4.0 * m / (3.0 * std::numbers::pi);
    const BondedLayer layer(nu);
    const double chi = 0.02;
    EXPECT_NEAR(layer.force_factor(chi), 1.0 + 1.5 * k * chi + 2.625 * k * k * chi * chi,
                20.0 * chi * chi * chi)
        << nu;
  }
}

// Values from an independent Fredholm solution: R 2, d 1.5, h 4 and R 5, d 1, h 4.
TEST(BondedLayer, AgreesWithPublishedFigures) {
  const BondedLayer layer(kNu);
  EXPECT_NEAR(layer.force_factor(std::sqrt(2.0 * 1.5) / 4.0), 1.85, 0.005);
  EXPECT_NEAR(layer.force_factor(std::sqrt(5.0 * 1.0) / 4.0), 2.29, 0.005);
  EXPECT_NEAR(layer.force_factor(0.43301270189), 1.8478, 1e-4);
  EXPECT_NEAR(layer.force_factor(0.55901699437), 2.28555, 1e-4);
  EXPECT_NEAR(layer.force_factor(1.05409255339), 4.88371, 3e-4);
  EXPECT_NEAR(layer.factors(1.05409255339).radius, 1.38917, 1e-4);
}

TEST(SphereLaw, DimitriadisUnderestimatesTheForceAsDocumented) {
  const BondedLayer layer(kNu);
  const auto shortfall = [&](double chi) {
    return 1.0 - dimitriadis_factor(chi, kNu) / layer.force_factor(chi);
  };
  EXPECT_LT(shortfall(0.2), 0.0105);
  EXPECT_NEAR(shortfall(0.5), 0.07, 0.005);
  EXPECT_NEAR(shortfall(1.0), 0.17, 0.005);
}

TEST(SphereLaw, DimitriadisHasThePublishedCoefficientsOfAnIncompressibleLayer) {
  // Eq. 13 of the paper, ν = 0.5: 1 + 1.133χ + 1.283χ² + 0.769χ³ + …
  const double h = 1e-3;
  const auto f = [](double chi) { return dimitriadis_factor(chi, 0.5); };
  EXPECT_NEAR((f(h) - f(-h)) / (2.0 * h), 1.133, 5e-4);
  EXPECT_NEAR((f(h) - 2.0 * f(0.0) + f(-h)) / (2.0 * h * h), 1.283, 5e-4);
}

TEST(SphereLaw, LayerForcesInvert) {
  const SphereLaw law({.thickness_mm = 4.0}, 2.0);
  for (const double depth : {0.01, 0.7, 1.5, 3.0}) {
    EXPECT_NEAR(law.at_force(law.at_depth(depth).force_mN).depth_mm, depth, 1e-9);
  }
}

TEST(SphereLaw, StiffeningSkinPressesHarderWithDepth) {
  for (const ContactLaw kind : {ContactLaw::kHertz, ContactLaw::kSneddon}) {
    const SphereLaw soft({.contact_law = kind}, 2.0);
    const SphereLaw stiffening({.stiffening_mm = 1.65, .contact_law = kind}, 2.0);
    for (const double depth : {0.2, 1.0, 1.5}) {
      const ContactState contact = stiffening.at_depth(depth);
      EXPECT_NEAR(contact.force_mN / soft.at_depth(depth).force_mN, std::exp(depth / 1.65), 1e-12);
      EXPECT_EQ(contact.contact_radius_mm, soft.at_depth(depth).contact_radius_mm);
      EXPECT_NEAR(stiffening.at_force(contact.force_mN).depth_mm, depth, 1e-9);
    }
  }
}

TEST(SphereLaw, FlatPlateOnACurvedFingerIsASphereOfTheFinger) {
  const SphereLaw plate({.radius_mm = 7.0}, std::numeric_limits<double>::infinity());
  const SphereLaw sphere({}, 7.0);
  EXPECT_DOUBLE_EQ(plate.at_depth(0.5).force_mN, sphere.at_depth(0.5).force_mN);
}

TEST(SphereLaw, PressureOfEveryLawCarriesItsForce) {
  for (const SkinParameters& skin :
       {SkinParameters{}, SkinParameters{.contact_law = ContactLaw::kSneddon},
        SkinParameters{.thickness_mm = 4.0}}) {
    const ContactState contact = SphereLaw(skin, 2.0).at_depth(1.2);
    const double carried = 2.0 / 3.0 * std::numbers::pi * contact.contact_radius_mm *
                           contact.contact_radius_mm * contact.peak_pressure_kPa;
    EXPECT_NEAR(carried / contact.force_mN, 1.0, 1e-12);
  }
}

}  // namespace
}  // namespace merkel
