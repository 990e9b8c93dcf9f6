#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// A spike in a file.
struct RecordedSpike {
  std::chrono::nanoseconds time{0};
  std::uint32_t neuron = 0;  ///< from 1

  friend bool operator==(const RecordedSpike&, const RecordedSpike&) = default;
  friend bool operator<(const RecordedSpike& a, const RecordedSpike& b) noexcept {
    return std::tie(a.time, a.neuron) < std::tie(b.time, b.neuron);
  }
};

/// The spikes of a CSV file, a session (XDF) or an NWB file.
struct SpikeFile {
  std::string format;                 ///< "CSV", "XDF" or "NWB"
  std::vector<RecordedSpike> spikes;  ///< in order of time, ties by neuron
  /// Times count from the start of the run; false: the file does not describe its zero of time.
  bool from_start = false;
};

/// Reads a whole file, of the format that its content shows. Accepts arbitrary bytes. Fails with a
/// sentence that names the place. Real-time: no.
[[nodiscard]] Expected<SpikeFile, SetupError> read_spike_file(const std::string& path);

/// The readers of read_spike_file(), by format.
[[nodiscard]] Expected<SpikeFile, SetupError> read_csv_spikes(const std::string& path);
[[nodiscard]] Expected<SpikeFile, SetupError> read_session_spikes(const std::string& path);
/// Fails in a build without HDF5.
[[nodiscard]] Expected<SpikeFile, SetupError> read_nwb_spikes(const std::string& path);

}  // namespace merkel
