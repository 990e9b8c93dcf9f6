#pragma once

#include "realtime/counter.hpp"

namespace merkel {

/// What the loop has done so far. Raised by the simulation thread, read by any.
struct LoopStatistics {
  Counter ticks;               ///< ticks simulated
  Counter overruns;            ///< ticks that ended after the next tick's deadline
  Counter longest_overrun_ns;  ///< by how much, at most
  Counter catch_up_ticks;      ///< ticks started late, one after the other, to catch up
  Counter gaps;                ///< times that ticks were left out
  Counter skipped_ticks;       ///< ticks left out in all
  Counter spikes;              ///< spikes made
  Counter neuron_resets;       ///< neurons reset because their state had turned non-finite
  Counter events_dropped;      ///< events that found their queue full
};

}  // namespace merkel
