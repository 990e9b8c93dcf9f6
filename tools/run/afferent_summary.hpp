#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/tactile_model.hpp"
#include "realtime/pipeline.hpp"
#include "tools/json_text.hpp"

namespace merkel {

/// One afferent in a run's summary.
struct AfferentActivity {
  std::size_t neuron = 0;  ///< from 1
  std::size_t receptors = 0;
  double mean_distance_mm = 0.0;  ///< between its receptors and the axis of the patch's first probe
  std::uint64_t spikes = 0;
  double rate_hz = 0.0;  ///< during the whole run
  /// Rate while a probe touched its patch; empty if none ever did.
  std::optional<double> contact_rate_hz;
};

/// One row for each afferent, in order of number.
[[nodiscard]] std::vector<AfferentActivity> afferent_rows(const RunReport& report,
                                                          const TactileModel& model);
/// The table as text, sorted by the rate during contact, highest first. \param all  every afferent;
/// false: the ten most active
[[nodiscard]] std::string afferent_text(std::vector<AfferentActivity> rows, bool all);
/// The rows as JSON, in order of number; a missing contact rate is null.
[[nodiscard]] Json afferent_json(const std::vector<AfferentActivity>& rows);

}  // namespace merkel
