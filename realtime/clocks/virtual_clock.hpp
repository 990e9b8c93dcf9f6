#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <thread>

namespace merkel {

/// Time that passes only when the loop waits, so that a recording is simulated as fast as possible
/// and without any sample being late.
class VirtualClock {
 public:
  [[nodiscard]] std::chrono::nanoseconds now() const noexcept { return now_; }
  void wait_until(std::chrono::nanoseconds time) noexcept { now_ = std::max(now_, time); }
  /// Spins a little, then sleeps: the other threads may need this core.
  bool wait_for_others() noexcept {
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
};

}  // namespace merkel
