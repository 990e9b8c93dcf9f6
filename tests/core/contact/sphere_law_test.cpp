#include "core/contact/sphere_law.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include <gtest/gtest.h>

#include "tools/studies/reference/bonded_layer.hpp"
#include "tools/studies/reference/superposition.hpp"

namespace merkel {
namespace {

using reference::BondedLayer;

constexpr double kNu = 0.48;
constexpr double kPlate = std::numeric_limits<double>::infinity();

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

TEST(SphereLaw, StiffeningSkinPressesHarderWithDepth) {
  for (const double along_mm : {0.0, 14.0}) {
    const SkinParameters rest{.radius_mm = 7.0, .radius_along_mm = along_mm};
    SkinParameters stiffening = rest;
    stiffening.stiffening_mm = 1.65;
    const SphereLaw soft(rest, 2.0);
    const SphereLaw stiff(stiffening, 2.0);
    for (const double depth : {0.2, 1.0, 1.5}) {
      const ContactState contact = stiff.at_depth(depth);
      EXPECT_NEAR(contact.force_mN / soft.at_depth(depth).force_mN, std::exp(depth / 1.65), 1e-12);
      EXPECT_EQ(contact.contact_radius_mm, soft.at_depth(depth).contact_radius_mm);
      EXPECT_NEAR(stiff.at_force(contact.force_mN).depth_mm, depth, 1e-9);
      EXPECT_NEAR(soft.at_force(soft.at_depth(depth).force_mN).depth_mm, depth, 1e-12);
    }
  }
}

// The elliptic integrals by quadrature: K = ∫1/√(1−e²sin²θ), E = ∫√(1−e²sin²θ), 0 to π/2.
TEST(SphereLaw, OnAFingerWithTwoRadiiItIsEllipticHertz) {
  for (const auto& [radius, across, along] :
       {std::tuple{2.0, 5.0, 10.0}, {5.0, 7.0, 14.0}, {kPlate, 5.0, 10.0}, {kPlate, 14.0, 7.0}}) {
    const SkinParameters skin{.radius_mm = across, .radius_along_mm = along};
    const HertzEllipse ellipse = *SphereLaw(skin, radius).ellipse();
    const double a = std::max(ellipse.half_x(), ellipse.half_y());
    const double b = std::min(ellipse.half_x(), ellipse.half_y());
    EXPECT_EQ(ellipse.half_x() > ellipse.half_y(), along > across);
    const double e2 = 1.0 - b * b / (a * a);
    const auto root = [e2](double t) { return std::sqrt(1.0 - e2 * std::sin(t) * std::sin(t)); };
    const double half_pi = 0.5 * std::numbers::pi;
    const double K = reference::integrate([&](double t) { return 1.0 / root(t); }, 0.0, half_pi);
    const double E = reference::integrate(root, 0.0, half_pi);
    const double A = 0.5 / radius + 0.5 / std::max(across, along);
    const double B = 0.5 / radius + 0.5 / std::min(across, along);
    EXPECT_NEAR((E / (1.0 - e2) - K) / (K - E) / (B / A), 1.0, 1e-8);
    const double modulus = SkinMaterial(skin).reduced_modulus_kPa();
    const double depth = 0.8;
    const double p0 = depth * modulus / (b * std::sqrt(depth) * K);
    EXPECT_NEAR(a * a * depth * e2 * A * modulus / (p0 * b * std::sqrt(depth) * (K - E)), 1.0,
                1e-8);
    const ContactState contact = SphereLaw(skin, radius).at_depth(depth);
    EXPECT_NEAR(contact.peak_pressure_kPa / p0, 1.0, 1e-10);
    EXPECT_NEAR(contact.force_mN / (2.0 / 3.0 * std::numbers::pi * a * b * depth * p0), 1.0, 1e-10);
  }
  // A plate on the finger of 7 x 14 mm, 1 mm deep.
  const SkinParameters finger{.radius_mm = 7.0, .radius_along_mm = 14.0};
  EXPECT_NEAR(SphereLaw(finger, kPlate).at_depth(1.0).force_mN, 554.6, 0.1);
}

TEST(SphereLaw, NearlyEqualRadiiGiveNearlyACircle) {
  const SphereLaw circle({.radius_mm = 7.0}, 2.0);
  const SphereLaw ellipse({.radius_mm = 7.0, .radius_along_mm = 7.0 + 1e-7}, 2.0);
  EXPECT_NEAR(ellipse.at_depth(1.0).force_mN / circle.at_depth(1.0).force_mN, 1.0, 1e-7);
  EXPECT_NEAR(ellipse.at_depth(1.0).contact_radius_mm, circle.at_depth(1.0).contact_radius_mm,
              1e-7);
}

TEST(SphereLaw, FlatPlateOnACurvedFingerIsASphereOfTheFinger) {
  const SphereLaw plate({.radius_mm = 7.0}, kPlate);
  const SphereLaw sphere({}, 7.0);
  EXPECT_DOUBLE_EQ(plate.at_depth(0.5).force_mN, sphere.at_depth(0.5).force_mN);
}

}  // namespace
}  // namespace merkel
