#include "core/encoding/field_map.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace merkel {

FieldMap::FieldMap(const Electrode& electrode)
    : discs_{{electrode.field_mm[0], electrode.field_mm[1], electrode.field_mm[2], 1.0}},
      border_mm_(electrode.border_mm) {}

FieldMap::FieldMap(const EncodingParameters& parameters, std::size_t group)
    : border_mm_(parameters.groups[group].pattern.border_mm) {
  const auto add = [this](const Electrode& of, double weight) {
    discs_.push_back({of.field_mm[0], of.field_mm[1], of.field_mm[2], weight});
  };
  const Electrode& pattern = parameters.groups[group].pattern;
  if (!pattern.field_mm.empty()) {
    add(pattern, 1.0);
    return;
  }
  for (const Electrode& each : parameters.electrodes) {
    if (each.group == group) add(each, each.group_weight);
  }
}

double FieldMap::weight(double x_mm, double y_mm, double reach_mm) const noexcept {
  double largest = 0.0;
  for (const Disc& disc : discs_) {
    const double dx_mm = x_mm - disc.x_mm;
    const double dy_mm = y_mm - disc.y_mm;
    const double square_mm2 = dx_mm * dx_mm + dy_mm * dy_mm;
    const double full_mm = disc.radius_mm + reach_mm;
    if (!(square_mm2 > full_mm * full_mm)) {
      largest = std::max(largest, disc.weight);
      continue;
    }
    const double outside_mm = std::sqrt(square_mm2) - full_mm;
    largest = std::max(largest, disc.weight * (1.0 - outside_mm / border_mm_));
  }
  return largest;
}

EncoderSources::EncoderSources(const EncodingParameters& parameters) {
  std::vector<std::optional<std::size_t>> of_group(parameters.groups.size());
  for (std::size_t e = 0; e < parameters.electrodes.size(); ++e) {
    const Electrode& each = parameters.electrodes[e];
    if (each.group && of_group[*each.group]) {
      of_electrode.push_back(*of_group[*each.group]);
      continue;
    }
    of_electrode.push_back(sources.size());
    first_electrode.push_back(e);
    if (!each.group) {
      sources.push_back({each, FieldMap(each)});
      continue;
    }
    of_group[*each.group] = sources.size();
    Electrode pattern = parameters.groups[*each.group].pattern;
    pattern.patch = each.patch;
    sources.push_back({std::move(pattern), FieldMap(parameters, *each.group)});
  }
}

}  // namespace merkel
