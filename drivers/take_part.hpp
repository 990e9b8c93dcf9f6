#pragma once

#include <algorithm>
#include <string_view>

namespace merkel {

/// Removes the text up to the next `mark` and the mark from `rest`, and returns the text.
inline std::string_view take_part(std::string_view& rest, char mark) noexcept {
  const std::string_view part = rest.substr(0, rest.find(mark));
  rest.remove_prefix(std::min(part.size() + 1, rest.size()));
  return part;
}

}  // namespace merkel
