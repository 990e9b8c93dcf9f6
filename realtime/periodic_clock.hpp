#pragma once

#include <chrono>

namespace merkel {

/// The host's monotonic clock and absolute sleeps on it. Real-time: the sleep is the only blocking
/// call of the simulation thread, and lives in this file.
class PeriodicClock {
 public:
  [[nodiscard]] std::chrono::nanoseconds now() const noexcept;
  void wait_until(std::chrono::nanoseconds time) noexcept;
  /// Sleeps until `time`, or not at all where it has passed.
  static void sleep_until(std::chrono::nanoseconds time) noexcept;
  static bool wait_for_others() noexcept { return false; }
};

}  // namespace merkel
