#include "core/receptors/receptive_field.hpp"

#include <algorithm>
#include <cmath>

namespace merkel {
namespace {

/// cos and sin of the golden angle π(3−√5). The spiral is built by repeated rotation, because the
/// cos of different C libraries differs in the last bit.
constexpr double kCosine = -0.73736887807831990;
constexpr double kSine = 0.67549029426152364;

}  // namespace

FieldTable ReceptiveField::fields() {
  static constexpr Field kFields[] = {
      {"field_receptors", "", from_to(1, 10'000), "receptors per afferent, with receptive fields",
       at<&ReceptiveField::receptors>},
      {"field_radius_mm", "mm", positive(1e3), "radius of a receptive field",
       at<&ReceptiveField::radius_mm>}};
  return {"receptors", kFields};
}

Expected<void, ParameterError> ReceptiveField::check(const Patch& patch) const {
  return ParameterCheck()
      .fields(*this)
      .require(2.0 * radius_mm <= std::min(patch.length_mm, patch.width_mm),
               "receptors.field_radius_mm",
               "must be at most half of the patch's shorter side: reduce it, or increase "
               "receptors.length_mm and width_mm")
      .result();
}

Expected<std::vector<Receptor>, ParameterError> place_fields(
    const ReceptiveField& field, const std::vector<FieldCentre>& centres, const Patch& patch) {
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
  std::vector<FieldCentre> offsets;
  double c = 1.0;
  double s = 0.0;
  for (std::int64_t k = 0; k < field.receptors; ++k) {
    const double r = field.radius_mm * std::sqrt((static_cast<double>(k) + 0.5) /
                                                 static_cast<double>(field.receptors));
    offsets.push_back({.x_mm = r * c, .y_mm = r * s});
    const double next = c * kCosine - s * kSine;
    s = s * kCosine + c * kSine;
    c = next;
  }
  std::vector<Receptor> receptors;
  receptors.reserve(centres.size() * offsets.size());
  for (std::size_t n = 0; n < centres.size(); ++n) {
    for (const FieldCentre& offset : offsets) {
      receptors.push_back({.x_mm = centres[n].x_mm + offset.x_mm,
                           .y_mm = centres[n].y_mm + offset.y_mm,
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
