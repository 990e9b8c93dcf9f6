#pragma once

#include <chrono>

namespace merkel {

/// The host's monotonic clock. Real-time: yes. Thread: any.
[[nodiscard]] std::chrono::nanoseconds host_now() noexcept;

/// Sleeps until a time of the monotonic clock; returns at once if it has passed. This is the
/// only blocking call of the simulation thread.
void host_sleep_until(std::chrono::nanoseconds time) noexcept;

}  // namespace merkel
