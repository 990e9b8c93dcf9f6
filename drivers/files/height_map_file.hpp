#pragma once

#include <string>
#include <string_view>

#include "core/contact/solver/height_map.hpp"
#include "core/expected.hpp"

namespace merkel {

/// Reads the heights of a tip above its lowest plane, mm: a NumPy file of two dimensions ("<f8" or
/// "<f4") if its name ends in .npy, else lines of numbers with commas. The first row is that of the
/// smallest y. `inf` is a place without a tip. The error is a sentence for a person.
[[nodiscard]] Expected<HeightMap, SetupError> read_height_map(const std::string& path,
                                                              double pixel_mm);

/// The same from the content of a file. \param name  for messages
[[nodiscard]] Expected<HeightMap, SetupError> parse_npy_heights(std::string_view bytes,
                                                                const std::string& name,
                                                                double pixel_mm);
[[nodiscard]] Expected<HeightMap, SetupError> parse_csv_heights(std::string_view text,
                                                                const std::string& name,
                                                                double pixel_mm);
/// The text from which parse_csv_heights() makes the same map.
[[nodiscard]] std::string csv_heights(const HeightMap& map);

}  // namespace merkel
