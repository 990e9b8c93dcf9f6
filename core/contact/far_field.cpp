#include "core/contact/far_field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/skin/point_load.hpp"
#include "core/skin/strain_energy_density.hpp"

namespace merkel {
namespace {

/// Distances over which the response of layers to a point load is tabulated.
constexpr double kFarthest_mm = 60.0;
constexpr double kPointDisc_mm = 0.05;
constexpr double kEnergyStep_mm = 0.1;
constexpr std::size_t kEnergies = 600;

}  // namespace

FarField::FarField(const LayeredMedium& medium, const SkinParameters& skin)
    : poisson_ratio_(SkinMaterial(skin).poisson_ratio()),
      receptor_depth_mm_(skin.receptor_depth_mm),
      surface_modulus_kPa_(medium.reduced_modulus_kPa()) {
  if (!medium.half_space()) {
    layers_.emplace(medium, receptor_depth_mm_, kPointDisc_mm, kFarthest_mm);
  }
}

SkinField FarField::at(double force_mN, double x_mm, double y_mm) const noexcept {
  const double r = std::hypot(x_mm, y_mm);
  const double half_space_mm = force_mN / (std::numbers::pi * surface_modulus_kPa_) / r;
  if (layers_) {
    return {.stress = cartesian(layers_->stress(r), x_mm, y_mm) * force_mN,
            .displacement = half_space_mm + force_mN * layers_->excess_displacement_mm(r)};
  }
  return {.stress = cartesian(point_load_stress(force_mN, poisson_ratio_, r, receptor_depth_mm_),
                              x_mm, y_mm),
          .displacement = half_space_mm};
}

FarEnergy::FarEnergy(const FarField& far, const SkinParameters& skin) {
  const SkinMaterial material(skin);
  for (std::size_t k = 0; k < kEnergies; ++k) {
    const double r = std::max(1e-3, kEnergyStep_mm * static_cast<double>(k));
    values_kPa_.push_back(
        energy_density_kPa(far.at(1.0, r, 0.0).stress, material, skin.energy_density));
  }
  for (std::size_t k = kEnergies - 1; k-- > 0;) {
    values_kPa_[k] = std::max(values_kPa_[k], values_kPa_[k + 1]);
  }
}

double FarEnergy::at(double r_mm) const noexcept {
  const double place = r_mm * (1.0 / kEnergyStep_mm);
  const auto k = std::min(static_cast<std::size_t>(place), kEnergies - 2);
  const double part = std::min(place - static_cast<double>(k), 1.0);
  return values_kPa_[k] + part * (values_kPa_[k + 1] - values_kPa_[k]);
}

double FarEnergy::reach_mm(double energy_kPa) const noexcept {
  const auto beyond = std::partition_point(values_kPa_.begin(), values_kPa_.end(),
                                           [&](double energy) { return energy > energy_kPa; });
  if (beyond == values_kPa_.end()) return std::numeric_limits<double>::infinity();
  return kEnergyStep_mm * static_cast<double>(beyond - values_kPa_.begin());
}

}  // namespace merkel
