#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>

#include "core/expected.hpp"

namespace merkel {

/// What poll() says of an open device.
enum class Readiness { kReady, kTimeout, kGone };

/// Waits until there is something to read. kGone: hung up, or failed.
[[nodiscard]] Readiness wait_readable(int descriptor, std::chrono::nanoseconds patience) noexcept;
/// The same until there is room to write.
[[nodiscard]] Readiness wait_writable(int descriptor, std::chrono::nanoseconds patience) noexcept;

/// Writes all of it to a non-blocking descriptor. False where the device is gone, or takes nothing
/// for a second.
[[nodiscard]] bool write_all(int descriptor, std::span<const std::uint8_t> bytes) noexcept;

/// Makes sure that nobody else of us has the port open. False if somebody has.
[[nodiscard]] bool lock_port(int descriptor) noexcept;

/// Why a port cannot be opened, and what to do about it.
[[nodiscard]] SetupError port_trouble(const std::string& port, int error_number);
/// The port is open elsewhere.
[[nodiscard]] SetupError port_busy(const std::string& port);

}  // namespace merkel
