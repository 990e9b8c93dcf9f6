#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// The description of a port.
struct TransportInfo {
  std::string name;           ///< device name as given, or VID:PID
  std::string serial_number;  ///< of the USB device; empty if none
  std::string note;           ///< how it was opened: latency timer, fallback
  /// Datagrams of the device that cannot be of its protocol, by their length, and the newest one.
  std::uint64_t rejected = 0;
  std::string newest_rejected;
  /// Times that the port lost data and began anew, before the bytes that follow.
  std::uint64_t restarts = 0;
  /// Of a HID device, if the system provides it; else empty.
  std::vector<std::uint8_t> report_descriptor;
};

/// The device is disconnected.
struct Disconnected {};

/// A port for bytes: serial, HID, USB, network. Used by one thread, which may block.
class Transport {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;

  [[nodiscard]] virtual const TransportInfo& info() const noexcept { return info_; }

  /// Reads available bytes; waits at most `patience` for the first one. 0 is a timeout.
  [[nodiscard]] virtual Expected<std::size_t, Disconnected> read(
      std::span<std::uint8_t> bytes, std::chrono::nanoseconds patience) = 0;
  /// Writes all bytes. Fails if the device is disconnected or stuck.
  [[nodiscard]] virtual Expected<void, Disconnected> write(std::span<const std::uint8_t> bytes) = 0;
  /// Closes the port and tries once to reopen the same device: with a VID, PID and serial number at
  /// any port, else at the same port.
  [[nodiscard]] virtual Expected<void, SetupError> reopen() = 0;

 protected:
  TransportInfo info_;
};

/// A port that has been opened.
template <class Port, class... Settings>
[[nodiscard]] Expected<std::unique_ptr<Transport>, SetupError> opened(const Settings&... settings) {
  auto port = std::make_unique<Port>(settings...);
  if (auto done = port->reopen(); !done) return Unexpected<SetupError>(done.error());
  return port;
}

}  // namespace merkel
