#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/calibration/probe_calibration.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// The channels of a device that are the readings of one probe: the part of its URI after '#'.
///
/// `#force=thumb_N,depth=3` names a channel, with or without its unit, or the number of its column
/// from 1. `#thumb_N` is short for `#force=thumb_N`: the unit tells force from depth. Without this
/// part, the probe is fed by the quantities that the device names itself (force_N, depth_mm).
struct ChannelSelection {
  /// Depth, force, x and y, as in kProbeChannels; empty: not chosen.
  std::array<std::string, kProbeChannels.size()> of;
  std::vector<std::string> by_unit;  ///< depth or force
  /// A tactile array instead: `#taxels=256*810000:pad`, the number of its taxels, the area of one
  /// in µm² (1 mm², if not given), and how the names of their channels begin.
  struct Taxels {
    std::size_t count = 0;
    double area_mm2 = 1.0;
    std::string prefix = {};
    bool tracks = true;  ///< the zero of each taxel follows its drift; not in the text
  };
  std::optional<Taxels> taxels = {};

  [[nodiscard]] bool empty() const noexcept;

  /// \param fragment  without '#'; empty: none
  [[nodiscard]] static Expected<ChannelSelection, std::string> parse(std::string_view fragment);
  /// The fragment that parse() reads back.
  [[nodiscard]] std::string text() const;

  /// The channels among those of a device. Fails with the device's channels if one is missing, or
  /// measures another quantity. Without chosen channels: the quantities that the device names
  /// itself, if any.
  [[nodiscard]] Expected<ProbeCalibration, std::string> among(
      std::span<const ChannelName> channels) const;
};

/// The name of a channel with the unit of its readings: "thumb_N" of "thumb_g".
[[nodiscard]] std::string in_unit_of_readings(const ChannelName& channel);

/// The names of a probe's channels: "thumb_N, thumb_mm".
[[nodiscard]] std::string names_of_channels(const ProbeCalibration& calibration);

/// The names of channels, at most twelve.
[[nodiscard]] std::string listed_channels(std::span<const ChannelName> channels);

/// Why a device with such a number of forces and pressures cannot feed an array; empty if it can.
[[nodiscard]] std::string wrong_taxels(std::size_t count, const ChannelSelection::Taxels& wanted);

/// What to do where a device measures neither a force nor a depth by that name.
/// \param channels  the names of those that it has
[[nodiscard]] std::string no_press_among(std::span<const std::string> channels);

/// A URI without what follows its '#', and that; empty: no '#'. A '#' within the name of a file is
/// part of the name.
[[nodiscard]] std::pair<std::string, std::optional<std::string>> split_fragment(
    std::string_view uri);

/// A device that feeds one or more probes.
struct DeviceUri {
  std::string uri;                             ///< without '#'
  std::vector<ChannelSelection> parts = {};    ///< one for each probe; empty: none is chosen
  std::vector<std::string> calibrations = {};  ///< a file for each probe; empty: none
  bool allow_remote = false;                   ///< other machines may send its samples

  /// Of a URI, with or without '#'.
  [[nodiscard]] static Expected<DeviceUri, SetupError> parse(std::string_view text);
};

}  // namespace merkel
