#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/realtime_tag.hpp"

namespace merkel {

/// The pressures that belong to the samples of a queue, a row for each, in the same order. The
/// writer fills a row before it queues the sample, so the sample's way through the queue publishes
/// the row. Real-time: yes, after construction.
class TaxelRows {
 public:
  TaxelRows(std::size_t taxels, std::size_t capacity)
      : taxels_(taxels), capacity_(capacity), values_(taxels * capacity) {}

  [[nodiscard]] std::size_t taxels() const noexcept { return taxels_; }

  /// The row of the next sample; empty if all rows are in use. Thread: the writer.
  [[nodiscard]] std::span<float> next() noexcept MERKEL_REALTIME {
    if (written_ - read_.load(std::memory_order_acquire) == capacity_) return {};
    return {values_.data() + written_ % capacity_ * taxels_, taxels_};
  }
  /// The sample of next() is in the queue. Thread: the writer.
  void push() noexcept MERKEL_REALTIME { ++written_; }

  /// The row of the oldest sample in the queue. Thread: the reader.
  [[nodiscard]] std::span<const float> front() const noexcept MERKEL_REALTIME {
    const std::uint64_t read = read_.load(std::memory_order_relaxed);
    return {values_.data() + read % capacity_ * taxels_, taxels_};
  }
  /// That sample was taken from the queue. Thread: the reader.
  void pop() noexcept MERKEL_REALTIME {
    read_.store(read_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

 private:
  std::size_t taxels_;
  std::size_t capacity_;
  std::vector<float> values_;
  std::uint64_t written_ = 0;
  std::atomic<std::uint64_t> read_{0};
};

}  // namespace merkel
