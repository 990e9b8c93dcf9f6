#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <string>

#include "drivers/spike_files/spike_file.hpp"

namespace merkel {

/// Reads a file of spikes and stops the program if what comes out cannot be.
/// \param most  no input of this size holds more spikes
inline void check_spikes(const std::string& path, std::size_t most) {
  const auto file = read_spike_file(path);
  if (!file) {
    if (file.error().sentence.empty()) std::abort();
    return;
  }
  if (file->spikes.size() > most) std::abort();
  if (!std::is_sorted(file->spikes.begin(), file->spikes.end())) std::abort();
  for (const RecordedSpike& spike : file->spikes) {
    if (spike.neuron == 0) std::abort();
  }
}

}  // namespace merkel
