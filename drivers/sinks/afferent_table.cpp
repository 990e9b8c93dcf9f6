#include "drivers/sinks/afferent_table.hpp"

#include "core/parameters/parameter_error.hpp"
#include "core/scene/patch_layout.hpp"

namespace merkel {

Expected<std::vector<AfferentRow>, ParameterError> afferents_of(const ModelParameters& model) {
  std::vector<AfferentRow> rows;
  std::uint32_t patch = 0;
  for (const PatchParameters& parameters : model.patches) {
    const auto layout = layout_of(parameters);
    if (!layout) return Unexpected<ParameterError>(layout.error());
    for (const AfferentSite& site : layout->afferents) {
      rows.push_back({.number = static_cast<std::uint32_t>(rows.size() + 1),
                      .patch = patch,
                      .x_mm = site.x_mm,
                      .y_mm = site.y_mm,
                      .field_radius_mm = site.radius_mm,
                      .receptors = static_cast<std::uint32_t>(site.receptors)});
    }
    ++patch;
  }
  return rows;
}

std::vector<AfferentRow> afferents_of(const SinkSetup& setup) {
  if (setup.neurons == 0) return {};
  return afferents_of(setup.run.model).value_or(std::vector<AfferentRow>{});
}

std::string afferent_csv(const std::vector<AfferentRow>& afferents) {
  if (afferents.empty()) return {};
  std::string text = "neuron,patch,x_mm,y_mm,field_radius_mm,receptors\n";
  for (const AfferentRow& row : afferents) {
    text += std::to_string(row.number) + "," + std::to_string(row.patch) + "," +
            shortest_decimal(row.x_mm) + "," + shortest_decimal(row.y_mm) + "," +
            shortest_decimal(row.field_radius_mm) + "," + std::to_string(row.receptors) + "\n";
  }
  return text;
}

}  // namespace merkel
