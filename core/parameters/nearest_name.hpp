#pragma once

#include <span>
#include <string>
#include <string_view>

namespace merkel {

/// The candidate with the fewest single-letter edits from `name`, for messages about a mistyped
/// key. Returns "" if none is near: more than a third of the letters (at least two) would have to
/// change, and the name is not a prefix of any candidate. Real-time: no.
[[nodiscard]] std::string nearest_name(std::string_view name,
                                       std::span<const std::string> candidates);

}  // namespace merkel
