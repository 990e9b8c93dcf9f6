#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/protocols/hbf1_channels.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// The HELLO of an HBF1 device: how its samples are laid out. Version 1 lists the channels of one
/// probe in one frame. Version 2 gives channels names; a list that does not fit in one frame comes
/// in several.
class Hbf1Hello {
 public:
  /// Why a HELLO cannot be used.
  struct Error {
    std::string sentence;  ///< empty: the frame is damaged
  };
  /// Adds a frame; one with the first channel begins the list anew.
  /// \return true if all channels are known
  [[nodiscard]] Expected<bool, Error> take(std::span<const std::uint8_t> body);

  /// Bits of DeviceChannel.
  [[nodiscard]] std::uint32_t channels() const noexcept { return channels_; }
  /// Those that are measured, in the order of the list.
  [[nodiscard]] const std::vector<ChannelName>& names() const noexcept { return names_; }
  /// Gives a channel with a name of its own the number that the name has had.
  /// \param known  the names so far, by number; gets new ones
  void number(std::vector<std::string>& known);
  [[nodiscard]] std::uint16_t rate_Hz() const noexcept { return rate_Hz_; }
  [[nodiscard]] const std::string& serial_number() const noexcept { return serial_number_; }

  /// Number of bytes of a sample's values.
  [[nodiscard]] std::size_t sample_bytes() const noexcept { return sample_bytes_; }
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
  struct Entry;
  class Body;

  [[nodiscard]] std::optional<Error> add(const Entry& entry);
  [[nodiscard]] std::optional<Error> name(const Entry& entry, const std::string& name,
                                          Channel& channel);
  [[nodiscard]] std::optional<Error> check_whole() const;

  std::size_t count_ = 0;  ///< of all channels
  std::size_t own_names_ = 0;
  std::vector<Channel> layout_;
  std::vector<ChannelName> names_;
  std::size_t sample_bytes_ = 0;
  std::uint32_t channels_ = 0;
  std::uint16_t rate_Hz_ = 0;
  std::string serial_number_;
};

/// Text of a device, with '?' for bytes that are not printable ASCII.
[[nodiscard]] std::string hbf1_text(std::span<const std::uint8_t> bytes);

}  // namespace merkel
