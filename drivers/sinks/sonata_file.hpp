#pragma once

#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/sinks/afferent_table.hpp"

namespace merkel {

/// What a SONATA file is made of.
struct SonataContent {
  std::string population;
  /// File of rows `time_ms,node_id` behind that header, in order of time. Comment lines `#
  /// name=value` before it become attributes of the population.
  std::string rows = {};
  std::vector<AfferentRow> afferents = {};
};

/// Writes a whole SONATA file: /spikes/<population> with timestamps in ms and node_ids from 0, and
/// /nodes/<population> with the afferents' positions and field radii. Bounded memory. On failure
/// nothing of that name is left, and a sentence says why.
[[nodiscard]] Expected<void, std::string> write_sonata(const std::string& path,
                                                       const SonataContent& content,
                                                       bool overwrite);

}  // namespace merkel
