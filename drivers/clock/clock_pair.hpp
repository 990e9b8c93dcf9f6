#pragma once

#include <chrono>

namespace merkel {

/// One instant on both clocks of this machine.
struct ClockPair {
  std::chrono::nanoseconds monotonic{0};  ///< CLOCK_MONOTONIC
  std::chrono::nanoseconds utc{0};        ///< since 1970-01-01
};

/// Reads both clocks at once, as close as a few tries come. Real-time: no.
[[nodiscard]] ClockPair read_clock_pair() noexcept;

}  // namespace merkel
