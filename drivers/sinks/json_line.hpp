#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace merkel {

/// JSON on one line. Bytes that are not UTF-8 become U+FFFD, so the result is valid JSON for any
/// input; numbers that are not finite become null.
[[nodiscard]] std::string json_line(const nlohmann::json& json);

/// A JSON string, quotes included.
[[nodiscard]] std::string json_string(std::string_view text);

}  // namespace merkel
