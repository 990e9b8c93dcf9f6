#pragma once

#include <atomic>
#include <cstddef>

#include "core/probe_sample.hpp"
#include "realtime/bounded_queue.hpp"
#include "realtime/counter.hpp"

namespace merkel {

/// What the thread of one probe and the simulation thread share.
struct ProbeChannel {
  explicit ProbeChannel(std::size_t capacity) : samples(capacity) {}

  BoundedQueue<ProbeSample> samples;  ///< probe thread → simulation thread
  Counter delivered;                  ///< samples put into the queue
  Counter dropped;                    ///< samples that found it full
  std::atomic<bool> ended{false};     ///< set after the last sample; none will follow
};

}  // namespace merkel
