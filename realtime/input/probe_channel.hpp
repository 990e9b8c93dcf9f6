#pragma once

#include <atomic>
#include <cstddef>

#include "core/records/probe_sample.hpp"
#include "core/records/tick_record.hpp"
#include "realtime/queues/bounded_queue.hpp"
#include "realtime/queues/counter.hpp"

namespace merkel {

/// What the thread of one probe and the simulation thread share.
struct ProbeChannel {
  explicit ProbeChannel(std::size_t capacity) : samples(capacity) {}

  BoundedQueue<ProbeSample> samples;  ///< probe thread → simulation thread
  Counter delivered;                  ///< samples put into the queue
  Counter dropped;                    ///< samples that found it full
  std::atomic<bool> ended{false};     ///< set after the last sample; none will follow

  /// Raised by the simulation thread.
  Counter used;        ///< samples that were there when their time came
  Counter late;        ///< samples whose time had already been simulated
  Counter held_ticks;  ///< readings for which the last sample was held
  /// The press of the last tick, for people to look at; of the simulation thread.
  std::atomic<double> depth_mm{0.0};
  std::atomic<double> force_mN{0.0};
  std::atomic<TickRecord::State> state{TickRecord::State::kFollowing};
  Counter released_ticks;  ///< readings without contact, the probe having been silent for too long
};

}  // namespace merkel
