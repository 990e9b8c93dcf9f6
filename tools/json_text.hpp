#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace merkel {

/// Keeps the order of its fields.
using Json = nlohmann::ordered_json;

/// JSON for stdout. Names of files and devices may hold bytes that are no UTF-8: they become
/// U+FFFD.
[[nodiscard]] inline std::string json_text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace merkel
