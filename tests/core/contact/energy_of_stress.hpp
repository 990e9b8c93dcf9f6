#pragma once

#include "core/skin/skin_material.hpp"
#include "core/skin/strain_energy_density.hpp"

namespace merkel {

inline double energy(const CartesianStress& stress, const SkinParameters& skin) {
  return energy_density_kPa(stress, SkinMaterial(skin), skin.energy_density);
}

}  // namespace merkel
