#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/protocols/device_reading.hpp"
#include "drivers/protocols/hbf1_channels.hpp"

namespace merkel {

/// The HELLO of an HBF1 device: how its samples are laid out.
class Hbf1Hello {
 public:
  /// Why a HELLO cannot be used.
  struct Error {
    std::string sentence;  ///< empty: the frame is damaged
  };
  [[nodiscard]] static Expected<Hbf1Hello, Error> parse(std::span<const std::uint8_t> body);

  /// Bits of DeviceChannel.
  [[nodiscard]] std::uint32_t channels() const noexcept { return channels_; }
  [[nodiscard]] std::uint16_t rate_Hz() const noexcept { return rate_Hz_; }
  [[nodiscard]] const std::string& serial_number() const noexcept { return serial_number_; }

  /// Number of bytes of a sample's values.
  [[nodiscard]] std::size_t sample_bytes() const noexcept;
  /// Sets the values of a sample, and `saturated` if one is at the limit of its format.
  /// \param values  sample_bytes() bytes
  void read_values(std::span<const std::uint8_t> values, DeviceReading& reading) const noexcept;

 private:
  struct Channel {
    std::optional<DeviceChannel> channel;  ///< not set: not used
    Hbf1Format format = Hbf1Format::kFloat;
    double scale = 1.0;
    double offset = 0.0;
    [[nodiscard]] std::size_t bytes() const noexcept {
      return format == Hbf1Format::kInt16 ? 2 : 4;
    }
  };
  static Expected<Channel, Error> parse_channel(std::span<const std::uint8_t> entry,
                                                std::size_t number);

  std::vector<Channel> layout_;
  std::uint32_t channels_ = 0;
  std::uint16_t rate_Hz_ = 0;
  std::string serial_number_;
};

/// Text of a device, with '?' for bytes that are not printable ASCII.
[[nodiscard]] std::string hbf1_text(std::span<const std::uint8_t> bytes);

}  // namespace merkel
