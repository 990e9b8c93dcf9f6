#pragma once

#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "drivers/spike_sink.hpp"

namespace merkel {

/// Marks on their way to one sink, added by any thread but the simulation's.
class MarkBox {
 public:
  /// Thread: any but the simulation's.
  void add(const Mark& mark) {
    const std::lock_guard lock(mutex_);
    if (marks_.size() < kMost) marks_.push_back(mark);
  }
  /// All marks added since the last call. Thread: consumer.
  [[nodiscard]] std::vector<Mark> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(marks_, {});
  }

 private:
  static constexpr std::size_t kMost = 4096;  ///< limit if the sink hangs

  std::mutex mutex_;
  std::vector<Mark> marks_;
};

}  // namespace merkel
