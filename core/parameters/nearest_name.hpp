#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>

namespace merkel {

/// The candidate with the fewest single-letter edits from `name`, for messages about a mistyped
/// key. Returns "" if none is near: more than a third of the letters (at least two) would have to
/// change, and the name is not a prefix of any candidate. Real-time: no.
[[nodiscard]] std::string nearest_name(std::string_view name,
                                       std::span<const std::string> candidates);

/// ": did you mean NAME?" with the nearest of the known names; if none is near, `otherwise`.
/// Real-time: no.
[[nodiscard]] std::string did_you_mean(std::string_view name, std::span<const std::string> known,
                                       const std::string& otherwise = {});

/// The items, or what a projection makes of each, as "a, b, c". Real-time: no.
template <class Items, class Projection = std::identity>
[[nodiscard]] std::string listed(const Items& items, const Projection& projection = {}) {
  std::string list;
  for (const auto& item : items) {
    list.append(list.empty() ? "" : ", ").append(std::invoke(projection, item));
  }
  return list;
}

}  // namespace merkel
