#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace merkel {

/// So many like channels are a tactile array.
inline constexpr std::size_t kMinTaxels = 16;

/// The number of taxels among the channels of a device: pressures, if there is no force with a name
/// of its own beside them (beside the force or depth of a probe, at least kMinTaxels), or at
/// least kMinTaxels forces that differ by their number (cell1_N, cell2_N, …). 0: it is no array.
/// \param channels  in N, mm and kPa
[[nodiscard]] std::size_t taxels_among(const std::vector<std::string>& channels);

/// The channels that the option columns of a probe URI names, in N, mm and kPa.
[[nodiscard]] std::vector<std::string> channels_of(const std::string& uri);
/// The same, of that option.
[[nodiscard]] std::vector<std::string> channels_in(const std::string& columns);

/// A layout of so many taxels: the columns along x, then the rows: the lines of a frame, or as
/// square as possible.
struct ArrayLayout {
  std::size_t columns = 0, rows = 0;
  [[nodiscard]] static ArrayLayout of(std::size_t taxels, const std::string& uri);
};

/// A scene of a tactile array at a device.
/// \param lacking  what would improve it, as comments
[[nodiscard]] std::string array_scene_text(const std::string& uri, std::size_t taxels,
                                           const std::vector<std::string>& lacking);

}  // namespace merkel
