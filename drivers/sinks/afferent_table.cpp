#include "drivers/sinks/afferent_table.hpp"

#include "core/parameters/parameter_error.hpp"
#include "core/scene/patch_layout.hpp"

namespace merkel {

std::vector<AfferentRow> afferents_of(const SinkSetup& setup) {
  std::vector<AfferentRow> rows;
  if (setup.neurons == 0) return rows;
  std::uint32_t patch = 0;
  for (const PatchParameters& parameters : setup.run.model.patches) {
    const auto layout = layout_of(parameters);
    if (!layout) return {};  // no model has such a patch
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
