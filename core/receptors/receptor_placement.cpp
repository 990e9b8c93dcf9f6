#include "core/receptors/receptor_placement.hpp"

#include <cmath>

#include "core/math/random.hpp"

namespace merkel {
namespace {

/// frac(½ + k(√5−1)/2), the golden-ratio sequence.
double golden_fraction(std::int64_t k) {
  const double position = 0.5 + static_cast<double>(k) * (std::sqrt(5.0) - 1.0) / 2.0;
  return position - std::floor(position);
}

}  // namespace

Expected<std::vector<Receptor>, ParameterError> place_receptors(
    const ReceptorParameters& parameters, const Patch& patch) {
  const auto checked = ParameterCheck()
                           .also(patch.check())
                           .whole_in_range("receptors.count", parameters.count, 0, kMaxReceptors)
                           .result();
  if (!checked) return Unexpected<ParameterError>(checked.error());
  const auto density = ReceptorDensity::create({.mean_per_mm2 = parameters.density_per_mm2,
                                                .max_per_mm2 = parameters.density_max_per_mm2,
                                                .min_per_mm2 = parameters.density_min_per_mm2,
                                                .length_mm = patch.length_mm});
  if (!density) return Unexpected<ParameterError>(density.error());

  const double expected = std::round(parameters.density_per_mm2 * patch.area_mm2());
  if (parameters.count == 0 && !(expected <= static_cast<double>(kMaxReceptors))) {
    return Unexpected<ParameterError>(
        {.key = "receptors.density_per_mm2",
         .reason = "gives more receptors than the limit of " + std::to_string(kMaxReceptors)});
  }
  const auto count = parameters.count > 0 ? parameters.count : static_cast<std::int64_t>(expected);

  std::vector<Receptor> receptors(static_cast<std::size_t>(count));
  Random random(parameters.seed);
  std::int64_t k = 0;
  for (Receptor& receptor : receptors) {
    if (parameters.placement == ReceptorParameters::Placement::kRandom) {
      receptor.x_mm = density->quantile_mm(random.uniform());
      receptor.y_mm = patch.width_mm * random.uniform();
    } else {
      const double fraction = (static_cast<double>(k) + 0.5) / static_cast<double>(count);
      receptor.x_mm = density->quantile_mm(fraction);
      receptor.y_mm = patch.width_mm * golden_fraction(k);
    }
    receptor.neuron = patch.neuron_at(receptor.x_mm, receptor.y_mm);
    ++k;
  }
  return receptors;
}

}  // namespace merkel
