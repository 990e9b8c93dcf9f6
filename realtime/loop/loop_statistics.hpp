#pragma once

#include "realtime/loop/latency_histogram.hpp"
#include "realtime/queues/counter.hpp"

namespace merkel {

/// What the loop has done so far. Raised by the simulation thread, read by any.
struct LoopStatistics {
  Counter ticks;               ///< ticks simulated
  Counter overruns;            ///< ticks that ended after the next tick's deadline
  Counter longest_overrun_ns;  ///< by how much, at most
  Counter late_wake_ups;       ///< overruns caused by a wake-up that came late
  Counter long_computes;       ///< overruns caused by a tick that took long to compute
  Counter catch_up_ticks;      ///< ticks started late, one after the other, to catch up
  Counter gaps;                ///< times that ticks were left out
  Counter skipped_ticks;       ///< ticks left out in all
  Counter spikes;              ///< spikes made
  Counter neuron_resets;       ///< neurons reset because their state had turned non-finite
  Counter events_dropped;      ///< events that found their queue full
  Counter timings_dropped;     ///< tick timings that found their queue full

  /// Where time goes between a sample and its spikes; of every tick.
  LatencyHistogram wake_up;  ///< from when a tick was due to when it began; of waits alone
  LatencyHistogram queue;    ///< from the sample's arrival to the tick's begin: the jitter buffer
  LatencyHistogram tick;     ///< from the tick's begin to the model's end
  LatencyHistogram publish;  ///< from there to its spikes being in the consumers' queues
};

}  // namespace merkel
