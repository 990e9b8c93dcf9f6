#pragma once

#include <chrono>

namespace merkel {

/// The host's clock, by which devices are read.
class HostClock {
 public:
  HostClock() = default;
  HostClock(const HostClock&) = delete;
  HostClock& operator=(const HostClock&) = delete;
  virtual ~HostClock() = default;

  /// Monotonic.
  [[nodiscard]] virtual std::chrono::nanoseconds now() = 0;
  virtual void sleep_for(std::chrono::nanoseconds time) = 0;

  /// The real clock.
  [[nodiscard]] static HostClock& real();
};

}  // namespace merkel
