#pragma once

#include "core/skin/skin_material.hpp"
#include "core/skin/stress.hpp"

namespace merkel {

/// Strain energy density, kPa. Distortional: 3·τ_oct²/(4G) (Eq. 3, with G corrected) with
/// 9·τ_oct² = (σ1−σ2)² + (σ2−σ3)² + (σ3−σ1)² + 6·Στ². Full: the same plus (σ1+σ2+σ3)²/(18K).
/// Real-time: yes.
[[nodiscard]] double energy_density_kPa(const AxisymmetricStress& stress, const SkinMaterial& skin,
                                        EnergyDensity kind) noexcept;
[[nodiscard]] double energy_density_kPa(const CartesianStress& stress, const SkinMaterial& skin,
                                        EnergyDensity kind) noexcept;

}  // namespace merkel
