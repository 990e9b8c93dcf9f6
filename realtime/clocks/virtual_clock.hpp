#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

namespace merkel {

/// Time that passes only when the loop waits. A recording is simulated as fast as possible, and no
/// sample is late.
class VirtualClock {
 public:
  VirtualClock() = default;
  /// \param stop  once set, no wait blocks any more; borrowed
  explicit VirtualClock(const std::atomic<bool>& stop) : stop_(&stop) {}

  [[nodiscard]] std::chrono::nanoseconds now() const noexcept { return now_; }
  [[nodiscard]] static std::chrono::nanoseconds processor_time() noexcept { return {}; }
  void wait_until(std::chrono::nanoseconds time) noexcept { now_ = std::max(now_, time); }
  /// Spins a little, then sleeps: the other threads may need this core.
  bool wait_for_others() noexcept {
    if (stop_ != nullptr && stop_->load(std::memory_order_relaxed)) return false;
    if (++idle_ % 64 == 0) {
      std::this_thread::sleep_for(std::chrono::microseconds{50});
    } else {
      std::this_thread::yield();
    }
    return true;
  }

 private:
  std::chrono::nanoseconds now_{0};
  std::uint32_t idle_ = 0;
  const std::atomic<bool>* stop_ = nullptr;
};

}  // namespace merkel
