#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/realtime_tag.hpp"
#include "core/records/readings.hpp"

namespace merkel {

/// The readings of a device on their way from its thread to one other, which takes them for each of
/// its probes by itself: a probe sees the readings in which it was measured. Never blocks and never
/// allocates after construction. When full, it refuses the reading; the caller counts the loss.
/// Real-time: yes.
class ReadingRing {
 public:
  /// \param capacity  least number of readings that fit, waiting for the slowest probe
  ReadingRing(ReadingColumns columns, std::size_t capacity)
      : columns_(std::move(columns)),
        heads_(std::bit_ceil(std::max<std::size_t>(capacity, 1))),
        values_(heads_.size() * columns_.width()),
        next_(columns_.probes()),
        passed_(columns_.probes(), std::chrono::nanoseconds::min()) {}

  [[nodiscard]] const ReadingColumns& columns() const noexcept { return columns_; }

  /// The row of the next reading, to be set before push(); empty when full. Thread: the writer.
  [[nodiscard]] std::span<double> next_row() noexcept MERKEL_REALTIME {
    const std::uint64_t written = written_.load(std::memory_order_relaxed);
    if (written - taken_.load(std::memory_order_acquire) == heads_.size()) return {};
    return row(written);
  }
  /// Thread: the writer.
  void push(const ReadingHead& head) noexcept MERKEL_REALTIME {
    const std::uint64_t written = written_.load(std::memory_order_relaxed);
    heads_[place(written)] = head;
    written_.store(written + 1, std::memory_order_release);
  }
  /// False when full. Thread: the writer.
  [[nodiscard]] bool try_push(const ReadingHead& head,
                              std::span<const double> values) noexcept MERKEL_REALTIME {
    const std::span<double> to = next_row();
    if (to.empty()) return false;
    std::copy(values.begin(), values.end(), to.begin());
    push(head);
    return true;
  }

  /// The oldest reading that a probe has not taken, or null; valid until it is popped.
  /// Thread: the reader, here and below.
  [[nodiscard]] const ReadingHead* front(std::size_t probe) noexcept MERKEL_REALTIME {
    const std::uint64_t written = written_.load(std::memory_order_acquire);
    const std::uint64_t before = next_[probe];
    std::uint64_t next = before;
    for (; next != written && !columns_.of(probe).measured_in(row(next)); ++next) {
      passed_[probe] = heads_[place(next)].time;
    }
    if (next != before) advance(probe, next);
    return next == written ? nullptr : &heads_[place(next)];
  }
  /// The time of the last reading without a value of a probe that front() has passed over.
  [[nodiscard]] std::chrono::nanoseconds passed(std::size_t probe) const noexcept MERKEL_REALTIME {
    return passed_[probe];
  }
  /// The row of front().
  [[nodiscard]] std::span<const double> front_row(std::size_t probe) noexcept MERKEL_REALTIME {
    return row(next_[probe]);
  }
  /// Takes front().
  void pop(std::size_t probe) noexcept MERKEL_REALTIME { advance(probe, next_[probe] + 1); }

  /// Approximate number of readings that wait for the slowest probe. Thread: any.
  [[nodiscard]] std::size_t size_approx() const noexcept MERKEL_REALTIME {
    return written_.load(std::memory_order_relaxed) - taken_.load(std::memory_order_relaxed);
  }

 private:
  [[nodiscard]] std::size_t place(std::uint64_t number) const noexcept {
    return number & (heads_.size() - 1);
  }
  [[nodiscard]] std::span<double> row(std::uint64_t number) noexcept {
    return {values_.data() + place(number) * columns_.width(), columns_.width()};
  }
  /// Frees what every probe has taken.
  void advance(std::size_t probe, std::uint64_t next) noexcept {
    const bool slowest = next_[probe] == taken_.load(std::memory_order_relaxed);
    next_[probe] = next;
    if (!slowest) return;
    taken_.store(*std::min_element(next_.begin(), next_.end()), std::memory_order_release);
  }

  ReadingColumns columns_;
  std::vector<ReadingHead> heads_;
  std::vector<double> values_;
  std::vector<std::uint64_t> next_;               ///< of each probe; of the reader
  std::vector<std::chrono::nanoseconds> passed_;  ///< the same
  std::atomic<std::uint64_t> written_{0};
  alignas(64) std::atomic<std::uint64_t> taken_{0};
};

}  // namespace merkel
