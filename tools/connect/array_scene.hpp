#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace merkel {

/// So many like channels are a tactile array.
inline constexpr std::size_t kFewestTaxels = 16;

/// The number of taxels among the columns of a device: forces or pressures that have one name and
/// differ by their number (taxel1_kPa, taxel2_kPa, …). 0: fewer than kFewestTaxels, so it is no
/// array. \param uri  of a probe, with the option columns
[[nodiscard]] std::size_t taxels_of(const std::string& uri);

/// A layout of so many taxels: the columns along x, then the rows; as square as possible.
struct ArrayLayout {
  std::size_t columns = 0, rows = 0;
  [[nodiscard]] static ArrayLayout of(std::size_t taxels);
};

/// A scene of a tactile array at a device.
/// \param lacking  what would improve it, as comments
[[nodiscard]] std::string array_scene_text(const std::string& uri, std::size_t taxels,
                                           const std::vector<std::string>& lacking);

}  // namespace merkel
