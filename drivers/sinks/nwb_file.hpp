#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/sessions/afferent_table.hpp"
#include "drivers/sink_setup.hpp"
#include "drivers/sinks/run_journal.hpp"
#include "drivers/sinks/time_base.hpp"

namespace merkel {

/// The content of an NWB file (Neurodata Without Borders 2.7).
struct NwbContent {
  RunDescription run;
  std::vector<AfferentRow> afferents;
  /// Facts of the experiment, from the sink's options: name and value.
  std::vector<std::pair<std::string, std::string>> general;
};

/// Writes a whole NWB file: units with spike times, positions and fields of the afferents; the
/// samples of the probes and the commands of the electrodes as the presented stimulus; contacts,
/// trials (from mark to mark; without marks, the contacts), events and pulses of sync lines as
/// intervals. Each afferent is observed from the begin of the first tick of its run to the end of
/// the last one, and samples of other times are left out. Uses bounded memory. On failure, leaves
/// no file of that name and returns the reason.
[[nodiscard]] Expected<void, std::string> write_nwb(const std::string& path,
                                                    const NwbContent& content, const TimeBase& time,
                                                    RunJournal& journal, bool overwrite);

}  // namespace merkel
