#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace merkel {

/// A channel of a device with several, as merkel connect found it.
struct FoundChannel {
  std::string name;                 ///< with its unit: "thumb_N"
  std::optional<double> last = {};  ///< its last value, N or mm; not set: it had none
  /// Standard deviation while the skin was not touched; not set: it was pressed all the time.
  std::optional<double> noise = {};
  [[nodiscard]] bool is_force() const { return name.ends_with("_N"); }
};

/// Where one of these channels presses.
struct PlacedChannel {
  FoundChannel channel;
  std::string patch;
  bool by_name = true;  ///< else only by its place in the line
};

/// The channels that feed a probe each, on the patches of the preset hand: the forces or, if there
/// is none, the depths. A patch is that of the channel's name; if no name is that of a patch, the
/// patches are taken in order.
[[nodiscard]] std::vector<PlacedChannel> place_on_hand(const std::vector<FoundChannel>& channels);

/// A scene of the preset hand: the device and a probe for each placed channel.
/// \param lacking  what would improve it, as comments
[[nodiscard]] std::string hand_scene_text(const std::string& uri,
                                          const std::vector<PlacedChannel>& placed,
                                          const std::vector<std::string>& lacking);

/// The standard deviation of forces while they were near 0, in the parts of a measurement of which
/// that can be said. \param values  in order of time, N
[[nodiscard]] std::optional<double> noise_at_rest(const std::vector<double>& values);

/// The keys of contact for a channel, contact_N and zero or contact_mm; empty if it has no noise,
/// or was pressed all the time.
[[nodiscard]] std::string contact_line(const FoundChannel& channel);

}  // namespace merkel
