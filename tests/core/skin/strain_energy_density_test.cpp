#include "core/skin/strain_energy_density.hpp"

#include <gtest/gtest.h>

#include "core/contact/hertz_contact.hpp"
#include "core/contact/huber_stress.hpp"

namespace merkel {
namespace {

TEST(StrainEnergyDensity, OfUniaxialStressIsTheDistortionEnergy) {
  // Uniaxial σ: distortion energy (1+ν)σ²/(3E).
  const SkinMaterial skin(100.0, 0.3);
  EXPECT_NEAR(
      energy_density_kPa(AxisymmetricStress{.sigma_z = -6.0}, skin, EnergyDensity::kDistortional),
      1.3 * 36.0 / 300.0, 1e-14);
}

TEST(StrainEnergyDensity, OfHydrostaticPressureIsZero) {
  const SkinMaterial skin(100.0, 0.3);
  const AxisymmetricStress pressure{.sigma_r = -5.0, .sigma_theta = -5.0, .sigma_z = -5.0};
  EXPECT_EQ(energy_density_kPa(pressure, skin, EnergyDensity::kDistortional), 0.0);
}

TEST(StrainEnergyDensity, FullIsTheElasticEnergyOfHookesLaw) {
  // ½σ:ε = [σ1² + σ2² + σ3² − 2ν(σ1σ2 + σ2σ3 + σ3σ1)]/(2E) + τ²/(2G)
  const SkinMaterial skin(100.0, 0.3);
  const AxisymmetricStress s{.sigma_r = -3.0, .sigma_theta = 1.0, .sigma_z = -7.0, .tau_rz = 2.0};
  const double expected = (9.0 + 1.0 + 49.0 - 0.6 * (-3.0 - 7.0 + 21.0)) / 200.0 +
                          4.0 / (2.0 * skin.shear_modulus_kPa());
  EXPECT_NEAR(energy_density_kPa(s, skin, EnergyDensity::kFull), expected, 1e-12);
}

TEST(StrainEnergyDensity, DoesNotDependOnTheAxes) {
  const SkinMaterial skin(100.0, 0.48);
  const AxisymmetricStress stress{
      .sigma_r = -3.0, .sigma_theta = 1.0, .sigma_z = -7.0, .tau_rz = 2.0};
  for (const EnergyDensity kind : {EnergyDensity::kDistortional, EnergyDensity::kFull}) {
    const double expected = energy_density_kPa(stress, skin, kind);
    for (const auto& [dx, dy] : {std::pair{1.0, 0.0}, {0.3, -2.0}, {-1.0, 1.0}, {0.0, 0.0}}) {
      EXPECT_NEAR(energy_density_kPa(cartesian(stress, dx, dy), skin, kind), expected,
                  1e-12 * expected);
    }
  }
}

TEST(StrainEnergyDensity, UnderTheSphereHasThePublishedPeaks) {
  // The paper's Fig. 5 set-up, R = 5 mm; and R = 2 mm at the same depth gives more.
  const SkinParameters parameters;
  const SkinMaterial skin(parameters);
  const auto at_axis = [&](double radius_mm, double depth_mm) {
    const HertzContact law(radius_mm, parameters.radius_mm, skin.reduced_modulus_kPa());
    return energy_density_kPa(huber_stress(law.at_depth(depth_mm), skin.poisson_ratio(), 0.0,
                                           parameters.receptor_depth_mm),
                              skin, EnergyDensity::kDistortional);
  };
  EXPECT_NEAR(at_axis(5.0, 1.0), 1.42, 0.005);
  EXPECT_NEAR(at_axis(2.0, 1.0), 4.85, 0.005);
}

}  // namespace
}  // namespace merkel
