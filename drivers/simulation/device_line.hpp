#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/expected.hpp"

namespace merkel {

/// The device's end of a connection to its host.
class DeviceLine {
 public:
  DeviceLine() = default;
  DeviceLine(const DeviceLine&) = delete;
  DeviceLine& operator=(const DeviceLine&) = delete;
  virtual ~DeviceLine() = default;

  [[nodiscard]] virtual Expected<void, SetupError> plug_in() = 0;
  virtual void unplug() noexcept = 0;
  /// Its address for the host, as in a URI: "serial:/dev/pts/3", "tcp:127.0.0.1:5000".
  [[nodiscard]] virtual std::string address() const = 0;
  /// True if a host listens.
  [[nodiscard]] virtual bool heard() const noexcept = 0;
  /// The host's baud rate; `own` if the line has none.
  [[nodiscard]] virtual int baud(int own) const noexcept { return own; }
  /// Reads the host's bytes; waits up to `patience` for them.
  [[nodiscard]] virtual std::size_t read(std::span<std::uint8_t> bytes,
                                         std::chrono::nanoseconds patience) noexcept = 0;
  /// Returns the number of bytes that fit: a device does not wait for its host.
  virtual std::size_t write(std::span<const std::uint8_t> bytes) noexcept = 0;
};

}  // namespace merkel
