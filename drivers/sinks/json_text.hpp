#pragma once

#include <string>
#include <string_view>

namespace merkel {

/// A JSON string, quotes included. Bytes that are not ASCII become '?', so that the result is valid
/// whatever comes in.
[[nodiscard]] std::string json_string(std::string_view text);

}  // namespace merkel
