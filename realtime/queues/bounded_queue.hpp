#pragma once

#include <cstddef>

#include <readerwriterqueue/readerwriterqueue.h>

#include "core/realtime_tag.hpp"
#include "realtime/queues/plain_data.hpp"

namespace merkel {

/// A queue from one thread to one other that never blocks and never allocates after construction.
/// When full, it refuses the item; the caller counts the loss. Real-time: yes, both ends.
///
/// No public header may include this one: the layout of the library's queue depends on NDEBUG, so a
/// program built without it must not see the queues of a library that was built with it.
template <PlainData T>
class BoundedQueue {
 public:
  /// \param capacity  least number of items that fit; the queue may hold slightly more
  explicit BoundedQueue(std::size_t capacity) : queue_(capacity) {
    // Touch every page once, so that the simulation thread causes no page fault.
    while (queue_.try_enqueue(T{})) {
    }
    while (queue_.pop()) {
    }
  }

  /// False when full. Thread: the writer.
  [[nodiscard]] bool try_push(const T& item) noexcept MERKEL_REALTIME {
    return queue_.try_enqueue(item);
  }
  /// False when empty. Thread: the reader.
  [[nodiscard]] bool try_pop(T& item) noexcept MERKEL_REALTIME { return queue_.try_dequeue(item); }
  /// The oldest item, or null; valid until it is popped. Thread: the reader.
  [[nodiscard]] const T* front() const noexcept MERKEL_REALTIME { return queue_.peek(); }
  /// Removes the oldest item. Thread: the reader.
  void pop() noexcept MERKEL_REALTIME { queue_.pop(); }
  /// Approximate number of items. Thread: any.
  [[nodiscard]] std::size_t size_approx() const noexcept MERKEL_REALTIME {
    return queue_.size_approx();
  }

 private:
  moodycamel::ReaderWriterQueue<T> queue_;
};

}  // namespace merkel
