#pragma once

#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/sessions/afferent_table.hpp"
#include "drivers/sinks/run_journal.hpp"
#include "drivers/sinks/time_base.hpp"

namespace merkel {

/// The content of a SONATA file.
struct SonataContent {
  std::string population;
  std::vector<AfferentRow> afferents = {};
};

/// Writes a SONATA file: /spikes/<population> with timestamps in ms and node_ids from 0, and
/// /nodes/<population> with positions and field radii of the afferents; beside it the table of node
/// types. The facts of `time` are attributes of the population. Uses bounded memory. On failure,
/// leaves no incomplete file and returns the reason.
[[nodiscard]] Expected<void, std::string> write_sonata(const std::string& path,
                                                       const SonataContent& content,
                                                       const TimeBase& time, RunJournal& journal,
                                                       bool overwrite);

/// The name of the table of node types: "dir/s_node_types.csv" for "dir/s.h5".
[[nodiscard]] std::string node_types_name(const std::string& path);

}  // namespace merkel
