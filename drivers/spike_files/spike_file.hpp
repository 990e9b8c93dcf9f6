#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// A spike as a file holds it.
struct RecordedSpike {
  std::chrono::nanoseconds time{0};
  std::uint32_t neuron = 0;  ///< from 1

  friend auto operator<=>(const RecordedSpike&, const RecordedSpike&) = default;
};

/// The spikes of a file of any format that merkel writes: CSV, GDF, a session (XDF), SONATA, NWB,
/// or a folder of Phy.
struct SpikeFile {
  std::string format;                 ///< "CSV", "GDF", "XDF", "SONATA", "NWB" or "Phy"
  std::vector<RecordedSpike> spikes;  ///< in order of time, ties by neuron
  /// Times count from the start of the run, as far as the file knows it; else from its own zero.
  bool from_start = false;
};

/// Reads a whole file; the format follows from what it holds. Fails with a sentence that names the
/// place. Any bytes may be in it. Real-time: no.
[[nodiscard]] Expected<SpikeFile, SetupError> read_spike_file(const std::string& path);

/// The formats that have files of their own: used by read_spike_file().
[[nodiscard]] Expected<SpikeFile, SetupError> read_text_spikes(const std::string& path);
[[nodiscard]] Expected<SpikeFile, SetupError> read_session_spikes(const std::string& path);
[[nodiscard]] Expected<SpikeFile, SetupError> read_phy_spikes(const std::string& folder);
/// SONATA and NWB; fails in a build without HDF5.
[[nodiscard]] Expected<SpikeFile, SetupError> read_hdf5_spikes(const std::string& path);

}  // namespace merkel
