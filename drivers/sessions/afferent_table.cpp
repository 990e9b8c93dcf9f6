#include "drivers/sessions/afferent_table.hpp"

#include <utility>

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
  std::string text;
  const char* separator = "";
  for_each_member(afferents.front(), [&](const char* name, const std::string&) {
    text.append(std::exchange(separator, ",")).append(name);
  });
  for (const AfferentRow& row : afferents) {
    separator = "\n";
    for_each_member(row, [&](const char*, const std::string& value) {
      text.append(std::exchange(separator, ",")).append(value);
    });
  }
  text += "\n";
  return text;
}

}  // namespace merkel
