#pragma once

#include <cstddef>
#include <type_traits>

#include <readerwriterqueue/readerwriterqueue.h>

#include "core/realtime_tag.hpp"

namespace merkel {

/// What may cross threads: no pointers to follow, nothing to free.
template <class T>
concept PlainData = std::is_trivially_copyable_v<T>;

/// A queue from one thread to one other that never blocks and never allocates after construction.
/// When it is full it refuses; the caller counts. Real-time: yes, both ends.
template <PlainData T>
class BoundedQueue {
 public:
  /// \param capacity  what fits at least; the queue may hold somewhat more
  explicit BoundedQueue(std::size_t capacity) : queue_(capacity) {
    // Every page is touched once, so that none is missing when the simulation thread comes to it.
    while (queue_.try_enqueue(T{})) {
    }
    while (queue_.pop()) {
    }
  }

  /// False when full. Thread: the one that writes.
  [[nodiscard]] bool try_push(const T& item) noexcept MERKEL_REALTIME {
    return queue_.try_enqueue(item);
  }
  /// False when empty. Thread: the one that reads.
  [[nodiscard]] bool try_pop(T& item) noexcept MERKEL_REALTIME { return queue_.try_dequeue(item); }
  /// The oldest item, or null; stays valid until it is popped. Thread: the one that reads.
  [[nodiscard]] const T* front() const noexcept MERKEL_REALTIME { return queue_.peek(); }
  /// Removes the oldest item. Thread: the one that reads.
  void pop() noexcept MERKEL_REALTIME { queue_.pop(); }
  /// Roughly how many items wait. Thread: any.
  [[nodiscard]] std::size_t size_approx() const noexcept MERKEL_REALTIME {
    return queue_.size_approx();
  }

 private:
  moodycamel::ReaderWriterQueue<T> queue_;
};

}  // namespace merkel
