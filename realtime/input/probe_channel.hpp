#pragma once

#include <atomic>
#include <cstddef>

#include "core/records/probe_sample.hpp"
#include "core/records/tick_record.hpp"
#include "realtime/queues/bounded_queue.hpp"
#include "realtime/queues/counter.hpp"

namespace merkel {

/// State shared by the thread of one probe and the simulation thread.
struct ProbeChannel {
  explicit ProbeChannel(std::size_t capacity) : samples(capacity) {}

  BoundedQueue<ProbeSample> samples;  ///< probe thread → simulation thread
  Counter delivered;                  ///< samples put into the queue
  Counter dropped;                    ///< samples dropped because the queue was full
  std::atomic<bool> ended{false};     ///< set after the last sample; none will follow
  /// Host time of the newest sample: its acquisition, at the latest its arrival.
  std::atomic<std::int64_t> newest_ns{0};

  /// Counted by the simulation thread.
  Counter used;        ///< samples that had arrived when their time was simulated
  Counter late;        ///< samples whose time had already been simulated
  Counter held_ticks;  ///< readings for which the last sample was held
  /// The press of the last tick, for display. Written by the simulation thread.
  std::atomic<double> depth_mm{0.0};
  std::atomic<double> force_mN{0.0};
  std::atomic<TickRecord::State> state{TickRecord::State::kFollowing};
  Counter released_ticks;  ///< readings without contact because the probe was silent for too long
};

}  // namespace merkel
