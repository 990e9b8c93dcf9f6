#pragma once

#include <cstddef>

#include "core/records/run_counters.hpp"
#include "realtime/loop/latency_histogram.hpp"
#include "realtime/queues/counter.hpp"

namespace merkel {

/// What a run has counted and measured so far. The simulation thread fills it; any thread reads it.
struct LoopStatistics : RunCountersOf<Counter> {
  /// The counters as plain numbers. Thread: any.
  [[nodiscard]] RunCounters snapshot() const noexcept {
    RunCounters counters;
    for (std::size_t i = 0; i < kRunCounterFields<>.size(); ++i) {
      counters.*kRunCounterFields<>[i].cell = (this->*kRunCounterFields<Counter>[i].cell).value();
    }
    return counters;
  }

  /// From the arrival of the last sample before a tick's end to its spikes' being published; of
  /// ticks with spikes.
  LatencyHistogram sample_to_spike;
  /// Where time goes between a sample and its spikes; of every tick.
  LatencyHistogram wake_up;  ///< from when a tick was due to when it began; of waits alone
  LatencyHistogram queue;    ///< from the sample's arrival to the tick's begin: the jitter buffer
  LatencyHistogram tick;     ///< from the tick's begin to the model's end
  LatencyHistogram publish;  ///< from there to its spikes being in the consumers' queues
};

}  // namespace merkel
