#pragma once

#include <array>
#include <cstdint>

#include "core/records/run_counters.hpp"

namespace merkel {

/// A run's counters at one time, for one sink: plain data.
struct RunStatus {
  /// Items that one sink has lost because its queues were full.
  struct Losses {
    std::uint64_t spikes = 0;
    std::uint64_t ticks = 0;
    std::uint64_t taxels = 0;
    std::uint64_t events = 0;
    std::uint64_t samples = 0;
    std::uint64_t edges = 0;
    std::uint64_t frames = 0;
    std::uint64_t commands = 0;

    friend bool operator==(const Losses&, const Losses&) = default;
  };

  /// The rights that the kernel grants the simulation thread. −1: unknown, or a virtual clock.
  struct Rights {
    std::int64_t scheduling_class = -1;
    std::int64_t priority = -1;
    std::int64_t cpu = -1;
    std::int64_t locked_memory_kB = -1;
    std::int64_t timer_slack_ns = -1;
    std::int64_t cpu_awake = -1;

    friend bool operator==(const Rights&, const Rights&) = default;
  };

  RunCounters counters;
  Losses losses;  ///< of the sink that receives this status
  Rights rights;
};

inline constexpr auto kLossFields = [] {
  using Losses = RunStatus::Losses;
  using Row = CounterField<Losses, std::uint64_t>;
  return std::array{
      Row{"lost_spikes", "", "spikes not in this file", &Losses::spikes, true},
      Row{"lost_ticks", "", "tick records not in this file: one per tick and probe", &Losses::ticks,
          true},
      Row{"lost_taxels", "", "blocks of taxels not in this file", &Losses::taxels, true},
      Row{"lost_events", "", "events not in this file", &Losses::events, true},
      Row{"lost_samples", "", "samples not in this file", &Losses::samples, true},
      Row{"lost_edges", "", "edges of sync lines not in this file", &Losses::edges, true},
      Row{"lost_frames", "", "chunks of device bytes not in this file", &Losses::frames, true},
      Row{"lost_commands", "", "stimulation commands not in this file", &Losses::commands, true},
  };
}();

inline constexpr auto kRightFields = [] {
  using Rights = RunStatus::Rights;
  using Row = CounterField<Rights, std::int64_t>;
  return std::array{
      Row{"scheduling_class", "", "of the loop: 0 normal, 1 FIFO", &Rights::scheduling_class},
      Row{"priority", "", "of the loop, 1 to 99 of FIFO, else 0", &Rights::priority},
      Row{"cpu", "", "core that the loop is pinned to, or -1", &Rights::cpu},
      Row{"locked_memory_kB", "kB", "locked memory of the process", &Rights::locked_memory_kB},
      Row{"timer_slack_ns", "ns", "timer slack of the loop", &Rights::timer_slack_ns},
      Row{"cpu_awake", "", "1 if idle cores are kept from deep sleep, else 0", &Rights::cpu_awake},
  };
}();

}  // namespace merkel
