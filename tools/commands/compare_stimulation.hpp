#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/spike_files/stimulation_file.hpp"
#include "tools/commands/compare_match.hpp"
#include "tools/json_text.hpp"

namespace merkel {

/// Reads the commands of a stim-csv file or of a session. Empty if the scene of a session has no
/// electrodes.
[[nodiscard]] Expected<StimulationFile, SetupError> read_stimulation_file(const std::string& path);

/// Largest differences between partners that count as equal.
struct StimulationTolerance {
  std::chrono::nanoseconds time{1000};
  double amplitude_uA = 0.0;
  double frequency_Hz = 0.0;
};

/// The commands of two files, matched by electrode, kind and time.
struct StimulationComparison {
  Matching<RecordedCommand> matching;
  /// Partners whose amplitude, frequency or reason to stop differs.
  std::vector<std::pair<RecordedCommand, RecordedCommand>> different;
  double largest_uA = 0.0;  ///< difference between partners
  double largest_Hz = 0.0;

  [[nodiscard]] bool equal() const noexcept { return matching.complete() && different.empty(); }
};

[[nodiscard]] StimulationComparison compare_stimulation(const StimulationFile& a,
                                                        const StimulationFile& b,
                                                        const StimulationTolerance& tolerance);

/// The result as lines of text. \param name_a, name_b  of the files
[[nodiscard]] std::string text_of(const StimulationComparison& result, const std::string& name_a,
                                  const std::string& name_b);
/// The result as a JSON object.
[[nodiscard]] Json json_of(const StimulationComparison& result);

}  // namespace merkel
