#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// Pulses of the sync lines that a recorder saw, on its clock: times of the rising edges in order,
/// by line.
struct PulseFile {
  std::string format;  ///< "times", "Open Ephys" or "session"
  std::map<std::uint32_t, std::vector<std::chrono::nanoseconds>> lines;
};

/// Reads the pulses of
/// - a text file: a time per row in its first column, in s, or as its header says (time_s, time_ms,
///   time_us, time_ns); SpikeGLX's edge files, and any CSV of times. Of rows with a `level`, those
///   of 1 are pulses, on their `line`;
/// - Open Ephys: the folder of a TTL line, or one of its files timestamps.npy (s) and
///   sample_numbers.npy (the rate is in structure.oebin); the levels are in states.npy;
/// - a session with sync lines.
/// Accepts arbitrary bytes. Fails with a sentence that names the place. Real-time: no.
[[nodiscard]] Expected<PulseFile, SetupError> read_pulse_file(const std::string& path);

}  // namespace merkel
