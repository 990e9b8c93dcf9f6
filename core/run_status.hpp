#pragma once

#include <cstdint>

namespace merkel {

/// What a run has counted so far: plain data, read while it runs.
struct RunStatus {
  /// What one sink has lost because its queues were full.
  struct Losses {
    std::uint64_t spikes = 0;
    std::uint64_t ticks = 0;  ///< records: one a tick and probe
    std::uint64_t events = 0;
    std::uint64_t samples = 0;

    friend bool operator==(const Losses&, const Losses&) = default;
  };

  std::uint64_t ticks = 0;
  std::uint64_t overruns = 0;
  std::uint64_t longest_overrun_ns = 0;
  std::uint64_t catch_up_ticks = 0;
  std::uint64_t gaps = 0;
  std::uint64_t skipped_ticks = 0;
  std::uint64_t spikes = 0;
  std::uint64_t neuron_resets = 0;
  std::uint64_t samples = 0;          ///< delivered by all probes
  std::uint64_t samples_dropped = 0;  ///< of all probes: found the loop's queue full
  std::uint64_t spikes_dropped = 0;   ///< of all sinks: found the sink's queue full
  std::uint32_t probes = 0;
  std::uint32_t probes_ended = 0;  ///< probes whose stream is over
  Losses losses;                   ///< of the sink that is told
};

}  // namespace merkel
