#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/expected.hpp"

namespace merkel {

/// The device's end of a line to its host.
class DeviceLine {
 public:
  DeviceLine() = default;
  DeviceLine(const DeviceLine&) = delete;
  DeviceLine& operator=(const DeviceLine&) = delete;
  virtual ~DeviceLine() = default;

  [[nodiscard]] virtual Expected<void, SetupError> plug_in() = 0;
  virtual void unplug() noexcept = 0;
  /// Under which the host finds it, as in a URI: "serial:/dev/pts/3", "tcp:127.0.0.1:5000".
  [[nodiscard]] virtual std::string address() const = 0;
  /// Whether a host listens.
  [[nodiscard]] virtual bool heard() const noexcept = 0;
  /// The rate that a host has set; nothing where lines have none.
  [[nodiscard]] virtual int baud(int own) const noexcept { return own; }
  /// What the host has sent, waiting up to `patience` for it.
  [[nodiscard]] virtual std::size_t read(std::span<std::uint8_t> bytes,
                                         std::chrono::nanoseconds patience) noexcept = 0;
  /// Returns how many bytes there was room for: a device does not wait for its host.
  virtual std::size_t write(std::span<const std::uint8_t> bytes) noexcept = 0;
};

}  // namespace merkel
