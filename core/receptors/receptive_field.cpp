#include "core/receptors/receptive_field.hpp"

#include <algorithm>
#include <cmath>

#include "core/math/normal_random.hpp"
#include "core/math/portable_math.hpp"

namespace merkel {
namespace {

/// cos and sin of the golden angle π(3−√5). The spiral is built by repeated rotation, because the
/// cos of different C libraries differs in the last bit.
constexpr double kCosine = -0.73736887807831990;
constexpr double kSine = 0.67549029426152364;

/// part^(quarters/4), by roots and products: the pow of different C libraries differs.
double quarter_power(double part, long quarters) {
  const double root = std::sqrt(part);
  double power = quarters % 4 >= 2 ? root : 1.0;
  if (quarters % 2 == 1) power *= std::sqrt(root);
  for (long k = 0; k < quarters / 4; ++k) power *= part;
  return power;
}

}  // namespace

FieldTable ReceptiveField::fields() {
  static constexpr Field kFields[] = {
      {"field_receptors", "", from_to(1, 10'000), "receptors per afferent, with receptive fields",
       at<&ReceptiveField::receptors>},
      {"field_radius_mm", "mm", positive(1e3), "radius of a receptive field",
       at<&ReceptiveField::radius_mm>, "", true},
      {"field_radius_spread", "", from_below(0.0, 2.0),
       "standard deviation of ln(field_radius_mm) between afferents, drawn with seed",
       at<&ReceptiveField::radius_spread>},
      {"field_concentration", "", from_to(0.25, 4.0),
       "q of the receptors' distances from the centre, field_radius_mm·((k+½)/n)^q, a multiple of "
       "0.25; 0.5: an even disc; more: dense in the middle",
       at<&ReceptiveField::concentration>}};
  return {"receptors", kFields};
}

Expected<void, ParameterError> ReceptiveField::check(const Patch& patch) const {
  return ParameterCheck()
      .fields(*this)
      .require(std::fmod(concentration, 0.25) == 0.0, "receptors.field_concentration",
               "must be a multiple of 0.25: 0.5 is an even disc, 1.25 has a dense middle")
      .require(2.0 * radius_mm <= std::min(patch.length_mm, patch.width_mm),
               "receptors.field_radius_mm",
               "must be at most half of the patch's shorter side: reduce it, or increase "
               "receptors.length_mm and width_mm")
      .result();
}

std::vector<double> field_radii(const ReceptiveField& field, std::size_t afferents,
                                std::uint64_t seed, const Patch& patch) {
  std::vector<double> radii_mm(afferents, field.radius_mm);
  if (field.radius_spread <= 0.0) return radii_mm;
  const double largest_mm = 0.5 * std::min(patch.length_mm, patch.width_mm);
  for (std::size_t n = 0; n < afferents; ++n) {
    // Step 0 of a stream is an afferent's gain.
    radii_mm[n] *= portable_exp(field.radius_spread * normal_random(seed, n, 1));
    radii_mm[n] = std::min(radii_mm[n], largest_mm);
  }
  return radii_mm;
}

Expected<std::vector<Receptor>, ParameterError> place_fields(
    const ReceptiveField& field, const std::vector<FieldCentre>& centres,
    const std::vector<double>& radii_mm, const Patch& patch) {
  ParameterCheck all;
  all.also(field.check(patch))
      .require(!centres.empty(), "receptors.centres_mm", "must list at least one afferent")
      .require(static_cast<std::int64_t>(centres.size()) <=
                   kMaxReceptors / std::max<std::int64_t>(1, field.receptors),
               "receptors.count", "gives more receptors than a patch can hold (10000000)");
  for (const FieldCentre& centre : centres) {
    if (patch.contains(centre.x_mm, centre.y_mm)) continue;
    all.require(false, "receptors.centres_mm",
                "has a receptive field at (" + shortest_decimal(centre.x_mm) + ", " +
                    shortest_decimal(centre.y_mm) + ") mm, outside the patch of " +
                    shortest_decimal(patch.length_mm) + " × " + shortest_decimal(patch.width_mm) +
                    " mm: move it, or set receptors.length_mm and width_mm");
  }
  if (const auto checked = all.result(); !checked) {
    return Unexpected<ParameterError>(checked.error());
  }
  struct Place {
    double distance;  ///< from the centre, in radii
    double cosine, sine;
  };
  std::vector<Place> spiral;
  double c = 1.0;
  double s = 0.0;
  for (std::int64_t k = 0; k < field.receptors; ++k) {
    spiral.push_back(
        {quarter_power((static_cast<double>(k) + 0.5) / static_cast<double>(field.receptors),
                       std::lround(4.0 * field.concentration)),
         c, s});
    const double next = c * kCosine - s * kSine;
    s = s * kCosine + c * kSine;
    c = next;
  }
  std::vector<Receptor> receptors;
  receptors.reserve(centres.size() * spiral.size());
  for (std::size_t n = 0; n < centres.size(); ++n) {
    for (const Place& place : spiral) {
      const double r = radii_mm[n] * place.distance;
      receptors.push_back({.x_mm = centres[n].x_mm + r * place.cosine,
                           .y_mm = centres[n].y_mm + r * place.sine,
                           .neuron = static_cast<std::uint32_t>(n + 1)});
    }
  }
  return receptors;
}

Expected<std::vector<FieldCentre>, ParameterError> place_centres(
    const ReceptorParameters& placement, const Patch& patch) {
  const auto placed = place_receptors(placement, patch);
  if (!placed) return Unexpected<ParameterError>(placed.error());
  std::vector<FieldCentre> centres;
  centres.reserve(placed->size());
  for (const Receptor& at : *placed) centres.push_back({.x_mm = at.x_mm, .y_mm = at.y_mm});
  return centres;
}

}  // namespace merkel
