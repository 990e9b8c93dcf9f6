#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "drivers/sink_setup.hpp"

namespace merkel {

/// One afferent, as described in files.
struct AfferentRow {
  std::uint32_t number = 0;      ///< through all patches, from 1
  std::uint32_t patch = 0;       ///< from 0
  double x_mm = 0.0;             ///< centre of its receptive field or subregion
  double y_mm = 0.0;             ///< patch coordinate across the finger
  double field_radius_mm = 0.0;  ///< of a subregion: its circumscribed circle
  std::uint32_t receptors = 0;
};

/// All afferents of a model, in order of their numbers. Fails if no model has such a patch.
[[nodiscard]] Expected<std::vector<AfferentRow>, ParameterError> afferents_of(
    const ModelParameters& model);

/// The same of a run. Empty for a run without a simulation.
[[nodiscard]] std::vector<AfferentRow> afferents_of(const SinkSetup& setup);

/// Calls work(name, value as text) for each column of an afferent.
template <class Work>
void for_each_member(const AfferentRow& row, const Work& work) {
  work("neuron", std::to_string(row.number));
  work("patch", std::to_string(row.patch));
  work("x_mm", shortest_decimal(row.x_mm));
  work("y_mm", shortest_decimal(row.y_mm));
  work("field_radius_mm", shortest_decimal(row.field_radius_mm));
  work("receptors", std::to_string(row.receptors));
}

/// The same as CSV with a header; empty if there are none.
[[nodiscard]] std::string afferent_csv(const std::vector<AfferentRow>& afferents);

}  // namespace merkel
