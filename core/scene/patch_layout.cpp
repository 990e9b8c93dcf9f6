#include "core/scene/patch_layout.hpp"

#include <cmath>
#include <cstdint>

#include "core/receptors/receptive_field.hpp"

namespace merkel {
namespace {

Expected<PatchLayout, ParameterError> subregions_of(const PatchParameters& parameters) {
  auto placed = place_receptors(parameters.receptors, parameters.patch);
  if (!placed) return Unexpected<ParameterError>(placed.error());
  PatchLayout layout{.receptors = std::move(*placed), .afferents = {}};
  const Patch& patch = parameters.patch;
  const double radius_mm =
      0.5 * std::hypot(patch.length_mm / patch.columns, patch.width_mm / patch.rows);
  const auto count = static_cast<std::uint32_t>(patch.subregions());
  for (std::uint32_t n = 1; n <= count; ++n) {
    layout.afferents.push_back({.x_mm = patch.centre_x_mm(n),
                                .y_mm = patch.centre_y_mm(n),
                                .radius_mm = radius_mm,
                                .receptors = 0});
  }
  for (const Receptor& receptor : layout.receptors) {
    ++layout.afferents[receptor.neuron - 1].receptors;
  }
  return layout;
}

Expected<PatchLayout, ParameterError> fields_of(const PatchParameters& parameters) {
  std::vector<FieldCentre> centres = parameters.centres;
  if (centres.empty()) {
    auto placed = place_centres(parameters.receptors, parameters.patch);
    if (!placed) return Unexpected<ParameterError>(placed.error());
    centres = std::move(*placed);
  }
  const std::vector<double> radii_mm =
      field_radii(parameters.field, centres.size(), parameters.receptors.seed, parameters.patch);
  auto placed = place_fields(parameters.field, centres, radii_mm, parameters.patch);
  if (!placed) return Unexpected<ParameterError>(placed.error());
  PatchLayout layout{.receptors = std::move(*placed), .afferents = {}};
  for (std::size_t n = 0; n < centres.size(); ++n) {
    layout.afferents.push_back({.x_mm = centres[n].x_mm,
                                .y_mm = centres[n].y_mm,
                                .radius_mm = radii_mm[n],
                                .receptors = static_cast<std::size_t>(parameters.field.receptors)});
  }
  return layout;
}

}  // namespace

Expected<PatchSize, ParameterError> size_of(const PatchParameters& parameters) {
  const bool fields = parameters.layout == ReceptorLayout::kFields;
  ParameterCheck all;
  all.also(parameters.patch.check()).fields(parameters.receptors);
  if (fields) all.also(parameters.field.check(parameters.patch));
  if (const auto checked = all.result(); !checked) {
    return Unexpected<ParameterError>(checked.error());
  }
  const double placed = parameters.receptors.number_on(parameters.patch);
  const char* const key =
      parameters.receptors.count > 0 ? "receptors.count" : "receptors.density_per_mm2";
  if (!fields) {
    return PatchSize{.receptors = placed,
                     .afferents = static_cast<double>(parameters.patch.subregions()),
                     .key = key};
  }
  const bool listed = !parameters.centres.empty();
  const double centres = listed ? static_cast<double>(parameters.centres.size()) : placed;
  return PatchSize{.receptors = centres * static_cast<double>(parameters.field.receptors),
                   .afferents = centres,
                   .key = listed ? "receptors.centres_mm" : key};
}

Expected<PatchLayout, ParameterError> layout_of(const PatchParameters& parameters) {
  return parameters.layout == ReceptorLayout::kSubregions ? subregions_of(parameters)
                                                          : fields_of(parameters);
}

}  // namespace merkel
