#include "drivers/sinks/json_text.hpp"

namespace merkel {

std::string json_string(std::string_view text) {
  std::string json = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      json += '\\';
      json += c;
    } else if (c == '\n') {
      json += "\\n";
    } else if (byte < 0x20) {
      json += ' ';
    } else {
      json += byte < 0x7F ? c : '?';
    }
  }
  return json + '"';
}

}  // namespace merkel
