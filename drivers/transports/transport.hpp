#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// What a port is, for people.
struct TransportInfo {
  std::string name;           ///< device name as given, or VID:PID
  std::string serial_number;  ///< of the USB device; empty where there is none
  std::string note;           ///< how it was opened: latency timer, fallback
  /// Of a HID device, where the system shows it; else empty.
  std::vector<std::uint8_t> report_descriptor;
};

/// The device is not there any more.
struct Disconnected {};

/// A port through which bytes go: serial, HID, USB. Used by one thread, which may block.
class Transport {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;

  [[nodiscard]] virtual const TransportInfo& info() const noexcept = 0;

  /// Reads what has come, waiting at most `patience` for the first byte; 0 is a timeout.
  [[nodiscard]] virtual Expected<std::size_t, Disconnected> read(
      std::span<std::uint8_t> bytes, std::chrono::nanoseconds patience) = 0;
  /// Writes all bytes, or finds the device gone or stuck.
  [[nodiscard]] virtual Expected<void, Disconnected> write(std::span<const std::uint8_t> bytes) = 0;
  /// Closes what is left and tries once to open the same device again: by its VID, PID and serial
  /// number wherever it is plugged in, else at the same port.
  [[nodiscard]] virtual Expected<void, SetupError> reopen() = 0;
};

}  // namespace merkel
