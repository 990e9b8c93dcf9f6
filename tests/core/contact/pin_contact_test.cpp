#include "core/contact/pin_contact.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "core/contact/flat_tip_field.hpp"
#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/skin/point_load.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "tools/studies/reference/flat_tip_boundary_elements.hpp"

namespace merkel {
namespace {

constexpr double kPoisson = 0.48;

/// The pressure under a pin is the derivative with respect to a of the pressure under a sphere with
/// p0 = P·a/(2πa₀²).
AxisymmetricStress by_slope(double force, double radius, double r, double z) {
  constexpr double kStep = 1e-4;
  const auto sphere = [&](double a) {
    return huber_stress(
        {.depth_mm = 1.0,
         .force_mN = 1.0,
         .contact_radius_mm = a,
         .peak_pressure_kPa = force * a / (2.0 * std::numbers::pi * radius * radius)},
        kPoisson, r, z);
  };
  const AxisymmetricStress above = sphere(radius + kStep);
  const AxisymmetricStress below = sphere(radius - kStep);
  const auto slope = [](double up, double down) { return (up - down) / (2.0 * kStep); };
  return {.sigma_r = slope(above.sigma_r, below.sigma_r),
          .sigma_theta = slope(above.sigma_theta, below.sigma_theta),
          .sigma_z = slope(above.sigma_z, below.sigma_z),
          .tau_rz = slope(above.tau_rz, below.tau_rz)};
}

TEST(PinContact, StressIsThatOfGrowingSpheres) {
  for (const double r : {0.0, 0.2, 0.5, 0.8, 3.0}) {
    for (const double z : {0.1, 0.65, 2.0}) {
      const AxisymmetricStress pin = pin_stress(100.0, 0.5, kPoisson, r, z);
      const AxisymmetricStress slope = by_slope(100.0, 0.5, r, z);
      EXPECT_NEAR(pin.sigma_r, slope.sigma_r, 1e-3) << r << " " << z;
      EXPECT_NEAR(pin.sigma_theta, slope.sigma_theta, 1e-3) << r << " " << z;
      EXPECT_NEAR(pin.sigma_z, slope.sigma_z, 1e-3) << r << " " << z;
      EXPECT_NEAR(pin.tau_rz, slope.tau_rz, 1e-3) << r << " " << z;
    }
  }
}

TEST(PinContact, FarAwayItIsAPointLoad) {
  const AxisymmetricStress pin = pin_stress(100.0, 0.5, kPoisson, 30.0, 20.0);
  const AxisymmetricStress point = point_load_stress(100.0, kPoisson, 30.0, 20.0);
  EXPECT_NEAR(pin.sigma_r, point.sigma_r, 1e-3 * std::fabs(point.sigma_r));
  EXPECT_NEAR(pin.sigma_z, point.sigma_z, 1e-3 * std::fabs(point.sigma_z));
  EXPECT_NEAR(pin.tau_rz, point.tau_rz, 1e-3 * std::fabs(point.tau_rz));
}

TEST(PinContact, CarriesItsForce) {
  // ∫ σz·2πr dr at a depth is −P.
  double sum = 0.0;
  constexpr double kStep = 0.01;
  for (double r = 0.5 * kStep; r < 200.0; r += kStep) {
    sum -= pin_stress(100.0, 0.5, kPoisson, r, 0.65).sigma_z * 2.0 * std::numbers::pi * r * kStep;
  }
  EXPECT_NEAR(sum, 100.0, 0.01);
}

TEST(PinContact, TheGridReproducesTheClosedForm) {
  const SkinParameters skin;
  const SkinMaterial material(skin);
  const FlatTipField field(PinTip{.diameter_mm = 1.0}, skin);
  const double force = field.force_mN(1.0);
  EXPECT_NEAR(force, 2.0 * 0.5 * material.reduced_modulus_kPa(), 1e-9);
  for (const double x : {-1.3, -0.4, 0.0, 0.33, 0.7}) {
    for (const double y : {-0.9, 0.01, 0.5}) {
      const double grid =
          energy_density_kPa(field.at(x, y, 1.0).stress, material, skin.energy_density);
      const double exact = energy_density_kPa(
          cartesian(pin_stress(force, 0.5, kPoisson, std::hypot(x, y), 0.65), x, y), material,
          skin.energy_density);
      EXPECT_NEAR(grid, exact, 3e-3 * 8.6) << x << " " << y;
    }
  }
  EXPECT_EQ(pin_displacement_mm(0.3, 0.5, 0.4), 0.3);
  EXPECT_NEAR(pin_displacement_mm(1.0, 0.5, 50.0),
              force / (std::numbers::pi * material.reduced_modulus_kPa() * 50.0), 1e-5);
}

TEST(PinContact, OnACurvedFingerItIsAPlateUntilItsRimIsReached) {
  const SkinParameters finger{.radius_mm = 7.0};
  const FlatTipField pin(PinTip{.diameter_mm = 2.0}, finger);
  const FlatTipField flat(PinTip{.diameter_mm = 2.0}, {});
  const HertzContact plate(std::numeric_limits<double>::infinity(), 7.0,
                           SkinMaterial(finger).reduced_modulus_kPa());
  const double rim_mm = 1.0 / 7.0;
  for (const double depth : {0.03, 0.1, rim_mm}) {
    EXPECT_NEAR(pin.force_mN(depth) / plate.at_depth(depth).force_mN, 1.0, 0.01) << depth;
  }
  EXPECT_NEAR(pin.force_mN(1.0), plate.at_depth(rim_mm).force_mN + flat.force_mN(1.0 - rim_mm),
              1e-6);
  const CartesianStress stress = pin.at(0.4, -0.3, rim_mm).stress;
  const CartesianStress hertz =
      cartesian(huber_stress(plate.at_depth(rim_mm), finger.poisson_ratio, 0.5, 0.65), 0.4, -0.3);
  EXPECT_NEAR(stress.sigma_z, hertz.sigma_z, 0.01 * std::fabs(hertz.sigma_z));
  EXPECT_NEAR(stress.tau_zx, hertz.tau_zx, 0.01 * std::fabs(hertz.sigma_z));
  EXPECT_NEAR(pin.depth_mm(pin.force_mN(0.7)), 0.7, 1e-9);
}

// 14 mm along the finger is not in the model: its pins touch as if the finger were as curved along
// it as across.
TEST(FlatTipField, APinOnACurvedFingerAgreesWithBoundaryElements) {
  struct Case {
    double diameter_mm, depth_mm, along_mm, force, middle, edge;  ///< ratios to boundary elements
  };
  for (const Case& c :
       {Case{1.0, 0.02, 7.0, 1.0, 1.0, 1.0}, Case{1.0, 0.3, 7.0, 1.0, 1.0, 1.0},
        Case{6.35, 0.5, 7.0, 1.0, 1.0, 1.0}, Case{6.35, 2.0, 7.0, 1.0, 1.0, 1.0},
        Case{1.0, 0.3, 14.0, 1.0, 1.0, 1.0}, Case{6.35, 0.5, 14.0, 0.83, 1.54, 0.205},
        Case{6.35, 2.0, 14.0, 0.93, 1.50, 0.437}}) {
    const SkinParameters skin{.radius_mm = 7.0};
    const SkinMaterial material(skin);
    const reference::FlatTipBoundaryElements elements(
        {.reduced_modulus_kPa = material.reduced_modulus_kPa(),
         .poisson_ratio = skin.poisson_ratio,
         .width_mm = c.diameter_mm,
         .length_mm = c.diameter_mm,
         .round = true,
         .skin_radius_mm = skin.radius_mm,
         .skin_radius_along_mm = c.along_mm,
         .depth_mm = c.depth_mm,
         .columns = 60,
         .rows = 60});
    const FlatTipField field(PinTip{.diameter_mm = c.diameter_mm}, skin);
    const auto ratio = [&](double x) {
      const auto energy = [&](const CartesianStress& stress) {
        return energy_density_kPa(stress, material, EnergyDensity::kDistortional);
      };
      return energy(field.at(x, 0.0, c.depth_mm).stress) / energy(elements.stress(x, 0.0, 0.65));
    };
    EXPECT_NEAR(field.force_mN(c.depth_mm) / elements.force_mN(), c.force, 0.03)
        << c.diameter_mm << " " << c.depth_mm << " " << c.along_mm;
    EXPECT_NEAR(ratio(0.0), c.middle, 0.03)
        << c.diameter_mm << " " << c.depth_mm << " " << c.along_mm;
    EXPECT_NEAR(ratio(0.5 * c.diameter_mm), c.edge, 0.03)
        << c.diameter_mm << " " << c.depth_mm << " " << c.along_mm;
  }
}

}  // namespace
}  // namespace merkel
