#pragma once

#include <cstddef>

#include "realtime/queues/bounded_queue.hpp"
#include "realtime/queues/counter.hpp"

namespace merkel {

/// A queue to one consumer that counts the items it had no room for.
template <PlainData T>
struct CountedQueue {
  explicit CountedQueue(std::size_t capacity) : items(capacity) {}

  BoundedQueue<T> items;
  Counter dropped;  ///< items that found the queue full
};

}  // namespace merkel
