#include "core/skin/strain_energy_density.hpp"

namespace merkel {

namespace {

/// \param shear2  the sum of the squared shear stresses
double from_stresses(double sigma_1, double sigma_2, double sigma_3, double shear2,
                     const SkinMaterial& skin, EnergyDensity kind) noexcept {
  const double d12 = sigma_1 - sigma_2;
  const double d23 = sigma_2 - sigma_3;
  const double d31 = sigma_3 - sigma_1;
  const double octahedral2 = (d12 * d12 + d23 * d23 + d31 * d31 + 6.0 * shear2) / 9.0;
  const double distortional = 3.0 * octahedral2 / (4.0 * skin.shear_modulus_kPa());
  if (kind == EnergyDensity::kDistortional) return distortional;
  const double trace = sigma_1 + sigma_2 + sigma_3;
  return distortional + trace * trace / (18.0 * skin.bulk_modulus_kPa());
}

}  // namespace

double energy_density_kPa(const AxisymmetricStress& stress, const SkinMaterial& skin,
                          EnergyDensity kind) noexcept {
  return from_stresses(stress.sigma_r, stress.sigma_theta, stress.sigma_z,
                       stress.tau_rz * stress.tau_rz, skin, kind);
}

double energy_density_kPa(const CartesianStress& stress, const SkinMaterial& skin,
                          EnergyDensity kind) noexcept {
  return from_stresses(
      stress.sigma_x, stress.sigma_y, stress.sigma_z,
      stress.tau_xy * stress.tau_xy + stress.tau_yz * stress.tau_yz + stress.tau_zx * stress.tau_zx,
      skin, kind);
}

}  // namespace merkel
