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

/// The device's end of a pseudo-terminal: what a program takes for a serial port is at `name()`.
class PtyMaster final : public DeviceLine {
 public:
  /// \param link  a symbolic link to make to it; none, if empty
  explicit PtyMaster(std::string link = {}) : wanted_link_(std::move(link)) {}
  ~PtyMaster() override { unplug(); }

  /// Only a link that an earlier simulation has left is replaced.
  [[nodiscard]] Expected<void, SetupError> plug_in() override;
  /// Hangs up on whoever has it open, and removes the link.
  void unplug() noexcept override;

  /// The link, or where there is none the terminal itself.
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  /// The rate that the other end has set; 0 until somebody has opened it.
  [[nodiscard]] int baud() const noexcept;
  [[nodiscard]] std::string address() const override { return "serial:" + name_; }
  [[nodiscard]] bool heard() const noexcept override { return baud() != 0; }
  [[nodiscard]] int baud(int /*own*/) const noexcept override { return baud(); }

  /// What the other end has sent, waiting up to `patience` for it.
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> bytes,
                                 std::chrono::nanoseconds patience) noexcept override;
  /// Returns how many bytes there was room for: a device does not wait for its host.
  std::size_t write(std::span<const std::uint8_t> bytes) noexcept override;

 private:
  Expected<void, SetupError> make_link(const std::string& link);

  std::string wanted_link_;
  std::string name_;
  std::string link_;
  std::string target_;  ///< of the link, while it is ours
  int master_ = -1;
  int slave_ = -1;  ///< held, so that the terminal lives while nobody has it open
};

}  // namespace merkel
