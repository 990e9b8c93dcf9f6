#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

#include "core/expected.hpp"
#include "drivers/simulation/device_line.hpp"

namespace merkel {

/// The device's end of a pseudo-terminal. Programs open `name()` as a serial port.
class PtyMaster final : public DeviceLine {
 public:
  /// \param link  a symbolic link to create to it; empty: none
  explicit PtyMaster(std::string link = {}) : wanted_link_(std::move(link)) {}
  ~PtyMaster() override { unplug(); }

  /// Replaces the link of an earlier simulation, but no other file.
  [[nodiscard]] Expected<void, SetupError> plug_in() override;
  /// Disconnects the programs that have it open, and removes the link.
  void unplug() noexcept override;

  /// The link or, without one, the terminal.
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  /// The baud rate of the other end; 0 until it has been opened.
  [[nodiscard]] int baud() const noexcept;
  [[nodiscard]] std::string address() const override { return "serial:" + name_; }
  [[nodiscard]] bool heard() const noexcept override { return baud() != 0; }
  [[nodiscard]] int baud(int /*own*/) const noexcept override { return baud(); }

  /// Reads bytes of the other end; waits up to `patience` for them.
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> bytes,
                                 std::chrono::nanoseconds patience) noexcept override;
  /// Returns the number of bytes that fit: a device does not wait for its host.
  std::size_t write(std::span<const std::uint8_t> bytes) noexcept override;

 private:
  Expected<void, SetupError> make_link(const std::string& link);

  std::string wanted_link_;
  std::string name_;
  std::string link_;
  std::string target_;  ///< target of the link while it exists
  int master_ = -1;
  int slave_ = -1;  ///< kept open, so that the terminal persists without a reader
};

}  // namespace merkel
