#include "drivers/sinks/json_line.hpp"

#include <nlohmann/json.hpp>

namespace merkel {

std::string json_line(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string json_string(std::string_view text) { return json_line(text); }

}  // namespace merkel
