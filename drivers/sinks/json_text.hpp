#pragma once

#include <string>
#include <string_view>

namespace merkel {

/// A JSON string, quotes included. Bytes that are not UTF-8 become U+FFFD, so the result is valid
/// JSON for any input.
[[nodiscard]] std::string json_string(std::string_view text);

}  // namespace merkel
