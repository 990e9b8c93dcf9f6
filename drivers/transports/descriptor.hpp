#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/expected.hpp"
#include "drivers/transports/transport.hpp"

namespace merkel {

/// The result of poll() on an open device.
enum class Readiness { kReady, kTimeout, kGone };

/// Waits until bytes can be read. kGone: hung up or failed.
[[nodiscard]] Readiness wait_readable(int descriptor, std::chrono::nanoseconds patience) noexcept;
/// Waits until bytes can be written.
[[nodiscard]] Readiness wait_writable(int descriptor, std::chrono::nanoseconds patience) noexcept;

/// Waits for bytes, then calls read() for them; 0 if none came in time. Fails if the device hung
/// up.
template <class Read>
[[nodiscard]] Expected<std::size_t, Disconnected> read_when_ready(int descriptor,
                                                                  std::chrono::nanoseconds patience,
                                                                  Read read) {
  switch (wait_readable(descriptor, patience)) {
    case Readiness::kTimeout:
      return std::size_t{0};
    case Readiness::kGone:
      return Unexpected<Disconnected>(Disconnected{});
    case Readiness::kReady:
      break;
  }
  return read();
}

/// Waits for bytes and reads those there are; 0 if none came in time. Fails if the device hung up.
[[nodiscard]] Expected<std::size_t, Disconnected> read_some(
    int descriptor, std::span<std::uint8_t> bytes, std::chrono::nanoseconds patience) noexcept;

/// Writes all bytes to a non-blocking descriptor. False if the device is disconnected or accepts
/// nothing for a second.
[[nodiscard]] bool write_all(int descriptor, std::span<const std::uint8_t> bytes) noexcept;

/// Locks a port against other merkel processes. False if one of them has it open.
[[nodiscard]] bool lock_port(int descriptor) noexcept;

/// The error for a port that cannot be opened, with its remedy.
[[nodiscard]] SetupError port_error(const std::string& port, int error_number);
/// The error for a port that another program has open.
[[nodiscard]] SetupError port_busy(const std::string& port);

}  // namespace merkel
