#pragma once

#include <chrono>
#include <ctime>
#include <optional>

namespace merkel {

/// The time of a clock of the kernel; empty if there is no such clock, as that of a thread that has
/// ended. Real-time: yes. Thread: any.
[[nodiscard]] std::optional<std::chrono::nanoseconds> clock_time(clockid_t clock) noexcept;

/// The host's monotonic clock. Real-time: yes. Thread: any.
[[nodiscard]] std::chrono::nanoseconds host_now() noexcept;

/// The processor time that the calling thread has used: without what other threads, or other guests
/// of the same machine, took from it. Real-time: yes, a call of the kernel.
[[nodiscard]] std::chrono::nanoseconds host_processor_time() noexcept;

/// Sleeps until a time of the monotonic clock; returns at once if it has passed. This is the
/// only blocking call of the simulation thread.
void host_sleep_until(std::chrono::nanoseconds time) noexcept;

}  // namespace merkel
