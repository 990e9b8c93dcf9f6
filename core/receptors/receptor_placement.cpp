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

FieldTable ReceptorParameters::fields() {
  using P = ReceptorParameters;
  static constexpr std::string_view kPlacements[] = {"random", "lattice"};
  static constexpr Field kFields[] = {
      {"placement", "", one_of(kPlacements),
       "random positions by the density law, or an even lattice that follows it",
       at<&P::placement>},
      {"seed", "", any_value(), "seed of random positions", at<&P::seed>},
      {"count", "", from_to(0, static_cast<double>(kMaxReceptors)),
       "number of receptors (of afferents, with receptive fields), whose density falls in the shape "
       "of the three densities; 0: density_per_mm2 × length_mm × width_mm",
       at<&P::count>},
      {"density_per_mm2", "1/mm²", positive(1e4),
       "mean density; where count is set, only its ratios to the other two matter",
       at<&P::density_per_mm2>},
      {"density_max_per_mm2", "1/mm²", positive(1e4), "density at the fingertip (x = 0)",
       at<&P::density_max_per_mm2>},
      {"density_min_per_mm2", "1/mm²", not_negative(1e4), "density far from the fingertip",
       at<&P::density_min_per_mm2>}};
  return {"receptors", kFields};
}

Expected<std::vector<Receptor>, ParameterError> place_receptors(
    const ReceptorParameters& parameters, const Patch& patch) {
  const auto checked = ParameterCheck().also(patch.check()).fields(parameters).result();
  if (!checked) return Unexpected<ParameterError>(checked.error());
  const auto density = ReceptorDensity::create({.mean_per_mm2 = parameters.density_per_mm2,
                                                .max_per_mm2 = parameters.density_max_per_mm2,
                                                .min_per_mm2 = parameters.density_min_per_mm2,
                                                .length_mm = patch.length_mm});
  if (!density) return Unexpected<ParameterError>(density.error());

  const double number = parameters.number_on(patch);
  if (!(number <= static_cast<double>(kMaxReceptors))) {
    return Unexpected<ParameterError>(
        {.key = "receptors.density_per_mm2",
         .reason = "gives more receptors than the limit of " + std::to_string(kMaxReceptors)});
  }
  std::vector<Receptor> receptors(static_cast<std::size_t>(number));
  Random random(parameters.seed);
  std::int64_t k = 0;
  for (Receptor& receptor : receptors) {
    if (parameters.placement == ReceptorParameters::Placement::kRandom) {
      receptor.x_mm = density->quantile_mm(random.uniform());
      receptor.y_mm = patch.width_mm * random.uniform();
    } else {
      const double fraction = (static_cast<double>(k) + 0.5) / number;
      receptor.x_mm = density->quantile_mm(fraction);
      receptor.y_mm = patch.width_mm * golden_fraction(k);
    }
    receptor.neuron = patch.neuron_at(receptor.x_mm, receptor.y_mm);
    ++k;
  }
  return receptors;
}

}  // namespace merkel
