#pragma once

#include <chrono>
#include <span>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/records/stimulation_command.hpp"
#include "drivers/sessions/session_reader.hpp"

namespace merkel {

/// A stimulation command in a file.
struct RecordedCommand {
  std::chrono::nanoseconds time{0};
  std::string electrode;  ///< its name
  StimulationCommand::Kind kind = StimulationCommand::Kind::kUpdate;
  double amplitude_uA = 0.0;
  double frequency_Hz = 0.0;
  StimulationCommand::Stop stop = StimulationCommand::Stop::kNone;
  std::chrono::nanoseconds sent{0};  ///< SentCommand::sent; 0: unknown, or a virtual clock
};

/// The stimulation commands of a file.
struct StimulationFile {
  std::vector<RecordedCommand> commands;   ///< in order of time
  std::vector<RecordedCommand> sent = {};  ///< of a session: what left, in order of time
  /// Times count from the start of the run; false: the file does not describe its zero of time.
  bool from_start = false;
};

/// Whether a file begins as the sink stim-csv: writes it; false if it cannot be read. Real-time:
/// no.
[[nodiscard]] bool is_stimulation_csv(const std::string& path);

/// Reads a file of the sink stim-csv:. Accepts arbitrary bytes. Fails with a sentence that names
/// the line. Real-time: no.
[[nodiscard]] Expected<StimulationFile, SetupError> read_stimulation_csv(const std::string& path);

/// Reads the commands of a session from its current position to its end.
/// \param electrodes  names of the electrodes, in the order of the session's scene
[[nodiscard]] Expected<StimulationFile, SetupError> read_session_commands(
    SessionReader& session, std::span<const std::string> electrodes);

}  // namespace merkel
