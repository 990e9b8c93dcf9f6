#pragma once

#include <chrono>

namespace merkel {

/// The host's time, as a device is read by it.
class HostClock {
 public:
  HostClock() = default;
  HostClock(const HostClock&) = delete;
  HostClock& operator=(const HostClock&) = delete;
  virtual ~HostClock() = default;

  /// Monotonic.
  [[nodiscard]] virtual std::chrono::nanoseconds now() = 0;
  virtual void sleep_for(std::chrono::nanoseconds time) = 0;

  /// The one on the wall.
  [[nodiscard]] static HostClock& real();
};

}  // namespace merkel
