#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>

#include "core/realtime_tag.hpp"

namespace merkel {

/// Announces when the next tick's spikes are due, so that each consumer wakes up by itself once per
/// tick. The simulation thread wakes no thread: it makes no system call and waits for nothing.
/// Times are host-monotonic.
class PublishBeat {
 public:
  /// The next tick is due at `due`. Real-time: yes. Thread: simulation.
  void expect(std::chrono::nanoseconds due) noexcept MERKEL_REALTIME {
    next_ns_.store(due.count() + typical_ns_, std::memory_order_relaxed);
  }
  /// A tick's spikes are in the queues at `time`, `after_due` after the tick was due. Real-time:
  /// yes. Thread: simulation.
  void published(std::chrono::nanoseconds time,
                 std::chrono::nanoseconds after_due) noexcept MERKEL_REALTIME {
    const std::int64_t usual = std::clamp<std::int64_t>(after_due.count(), 0, kMaxUsual_ns);
    typical_ns_ += (usual - typical_ns_) / 8;
    last_ns_.store(time.count(), std::memory_order_relaxed);
    ticks_.store(ticks_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  /// When the last tick was published. Thread: any.
  [[nodiscard]] std::chrono::nanoseconds last_published() const noexcept {
    return std::chrono::nanoseconds{last_ns_.load(std::memory_order_relaxed)};
  }

  static constexpr std::chrono::nanoseconds kMaxWait{5'000'000};
  /// Waits until a tick after `seen` has been published, and updates `seen`. Returns after about
  /// `longest` at the latest. Thread: consumer.
  void wait(std::uint64_t& seen, std::chrono::nanoseconds longest = kMaxWait) const noexcept;

 private:
  static constexpr std::int64_t kMaxUsual_ns = 1'000'000;  ///< stalls do not shift the expectation
  std::atomic<std::uint64_t> ticks_{0};
  std::atomic<std::int64_t> next_ns_{0};
  std::atomic<std::int64_t> last_ns_{0};
  std::int64_t typical_ns_ = 0;
};

}  // namespace merkel
