#pragma once

#include <cmath>
#include <string>
#include <string_view>

#include "core/parameters/parameter_error.hpp"
#include "drivers/sinks/json_text.hpp"

namespace merkel {

/// A JSON object or list, written sequentially.
class JsonWriter {
 public:
  explicit JsonWriter(char opening = '{') : text_(1, opening) {}

  JsonWriter& item(const std::string& json) {
    if (text_.size() > 1) text_ += ',';
    text_ += json;
    return *this;
  }
  JsonWriter& raw(std::string_view name, const std::string& json) {
    return item(json_string(name) + ":" + json);
  }
  JsonWriter& text(std::string_view name, std::string_view value) {
    return raw(name, json_string(value));
  }
  JsonWriter& number(std::string_view name, double value) { return raw(name, number_of(value)); }
  [[nodiscard]] std::string end() { return text_ + (text_.front() == '{' ? '}' : ']'); }

  /// JSON has no infinity: it becomes null.
  static std::string number_of(double value) {
    return std::isfinite(value) ? shortest_decimal(value) : "null";
  }

 private:
  std::string text_;
};

}  // namespace merkel
