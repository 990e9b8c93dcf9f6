#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>

#include "core/realtime_tag.hpp"

namespace merkel {

/// Tells consumers when the next tick's spikes are to be expected, so that each wakes up by itself,
/// once a tick, and the simulation thread need not wake anybody: no system call, nothing to wait
/// for. Times are host-monotonic.
class PublishBeat {
 public:
  /// The next tick is due at `due`. Real-time: yes. Thread: simulation.
  void expect(std::chrono::nanoseconds due) noexcept MERKEL_REALTIME {
    next_ns_.store(due.count() + typical_ns_, std::memory_order_relaxed);
  }
  /// A tick's spikes are in the queues, so long after it was due. Real-time: yes. Thread:
  /// simulation.
  void published(std::chrono::nanoseconds after_due) noexcept MERKEL_REALTIME {
    const std::int64_t usual = std::clamp<std::int64_t>(after_due.count(), 0, kMostUsual_ns);
    typical_ns_ += (usual - typical_ns_) / 8;
    ticks_.store(ticks_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  /// Waits until a tick after `seen` has been published, and raises `seen`; returns after about
  /// 5 ms in any case. Thread: consumer.
  void wait(std::uint64_t& seen) const noexcept;

 private:
  static constexpr std::int64_t kMostUsual_ns = 1'000'000;  ///< a stall is not what to expect
  std::atomic<std::uint64_t> ticks_{0};
  std::atomic<std::int64_t> next_ns_{0};
  std::int64_t typical_ns_ = 0;
};

}  // namespace merkel
