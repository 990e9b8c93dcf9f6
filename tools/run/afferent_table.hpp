#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "core/scene/tactile_model.hpp"
#include "realtime/pipeline.hpp"

namespace merkel {

/// What a run's summary reports of one afferent.
struct AfferentRow {
  std::size_t neuron = 0;  ///< from 1
  std::size_t receptors = 0;
  double mean_distance_mm = 0.0;  ///< of its receptors from the axis of the patch's first probe
  std::uint64_t spikes = 0;
  double rate_hz = 0.0;  ///< during the whole run
  /// While a probe touched its patch; none where none ever did.
  std::optional<double> contact_rate_hz;
};

/// One row for each afferent, by number.
[[nodiscard]] std::vector<AfferentRow> afferent_rows(const RunReport& report,
                                                     const TactileModel& model);
/// The table for people, the highest rate during contact first. \param all  every afferent; else
/// the ten most active
[[nodiscard]] std::string afferent_text(std::vector<AfferentRow> rows, bool all);
/// The rows by number, for programs; a rate during contact that does not exist is null.
[[nodiscard]] nlohmann::ordered_json afferent_json(const std::vector<AfferentRow>& rows);

}  // namespace merkel
