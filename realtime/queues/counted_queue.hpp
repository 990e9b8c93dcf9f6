#pragma once

#include <cstddef>

#include "realtime/queues/bounded_queue.hpp"
#include "realtime/queues/counter.hpp"

namespace merkel {

/// A queue to one consumer, with a count of the items dropped because it was full.
template <PlainData T>
struct CountedQueue {
  explicit CountedQueue(std::size_t capacity) : items(capacity) {}

  BoundedQueue<T> items;
  Counter dropped;  ///< items dropped because the queue was full
};

}  // namespace merkel
