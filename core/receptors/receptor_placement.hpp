#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/receptors/patch.hpp"
#include "core/receptors/receptor_density.hpp"

namespace merkel {

/// One Merkel cell-neurite complex (MCNC).
struct Receptor {
  double x_mm = 0.0;
  double y_mm = 0.0;
  std::uint32_t neuron = 0;  ///< the afferent that sums its current, from 1
};

/// How the receptors of a patch are placed (Eq. 9).
struct ReceptorParameters {
  enum class Placement {
    kRandom,   ///< x = F⁻¹(u·F(l)), y uniform, u and y from the seeded generator
    kLattice,  ///< x_k = F⁻¹((k+½)/N·F(l)), y_k = w·frac(½ + k(√5−1)/2): no randomness
  };

  Placement placement = Placement::kRandom;
  std::uint64_t seed = 1;
  std::int64_t count = 0;  ///< N; 0: density · area
  double density_per_mm2 = 0.75;
  double density_max_per_mm2 = 1.29;
  double density_min_per_mm2 = 0.143;

  /// N, also where it follows from the density; not a number if they are not.
  [[nodiscard]] double number_on(const Patch& patch) const {
    return count != 0 ? static_cast<double>(count) : std::round(density_per_mm2 * patch.area_mm2());
  }
  [[nodiscard]] static FieldTable fields();
};

/// Largest number of receptors a patch may hold.
inline constexpr std::int64_t kMaxReceptors = 10'000'000;

/// Places the receptors of a patch, in the order of drawing. The same parameters give
/// the same bits on every machine. Real-time: no.
[[nodiscard]] Expected<std::vector<Receptor>, ParameterError> place_receptors(
    const ReceptorParameters& parameters, const Patch& patch);

}  // namespace merkel
