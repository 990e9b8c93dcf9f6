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
    std::uint64_t frames = 0;  ///< of the devices' bytes

    friend bool operator==(const Losses&, const Losses&) = default;
  };

  /// What the simulation thread has got of the host; −1 where it is not known or, on a virtual
  /// clock, does not matter.
  struct Rights {
    std::int32_t scheduling_class = -1;  ///< 0 normal, 1 FIFO
    std::int32_t priority = -1;          ///< 1 to 99 of FIFO, else 0
    std::int32_t cpu = -1;               ///< the one it is pinned to, if it is
    std::int64_t locked_memory_kB = -1;  ///< of the process
    std::int64_t timer_slack_ns = -1;
    std::int32_t cpu_awake = -1;  ///< 1 if idle cores are kept from deep sleep, else 0

    friend bool operator==(const Rights&, const Rights&) = default;
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
  Rights rights;
};

}  // namespace merkel
