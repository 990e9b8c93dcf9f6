#include "core/parameters/range.hpp"

#include <array>
#include <charconv>
#include <cmath>

namespace merkel {

std::string shortest_decimal(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string readable_decimal(double value) {
  const double size = std::fabs(value);
  if (size != 0.0 && !(size >= 1e-4 && size < 1e7)) return shortest_decimal(value);
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed).ptr;
  return {text.data(), end};
}

bool Range::holds(double value) const noexcept {
  if (or_infinite && value == std::numeric_limits<double>::infinity()) return true;
  const bool high_enough = above_low ? value > low : value >= low;
  const bool low_enough = below_high ? value < high : value <= high;
  return std::isfinite(value) && high_enough && low_enough;
}

std::string Range::text() const {
  std::string text;
  if (!words.empty()) {
    for (const std::string_view word : words) {
      text.append(text.empty() ? "\"" : ", \"").append(word).append("\"");
    }
    return text;
  }
  const bool bounded = std::isfinite(high);
  if (!std::isfinite(low) && !bounded) return {};
  text = (above_low ? "> " : bounded ? "" : "≥ ") + readable_decimal(low);
  if (bounded) text += (below_high ? " to < " : " to ") + readable_decimal(high);
  return or_infinite ? text + ", or inf" : text;
}

std::string Range::fault(double value) const {
  if (holds(value)) return {};
  const std::string but_is = ", but is " + shortest_decimal(value);
  const std::string or_inf = or_infinite ? " or inf" : "";
  if (below_high) {
    return "must be at least " + readable_decimal(low) + " and below " + readable_decimal(high) +
           but_is;
  }
  if (std::isfinite(value) && value > high) {
    return "must be at most " + readable_decimal(high) + or_inf + but_is;
  }
  if (low == 0.0) {
    return (above_low ? "must be a positive number" : "must be zero or a positive number") +
           or_inf + but_is;
  }
  if (!std::isfinite(value)) return "must be a finite number" + but_is;
  return "must be at least " + readable_decimal(low) + but_is;
}

std::string Range::fault(std::int64_t value) const {
  if (holds(static_cast<double>(value))) return {};
  return "must be a whole number from " + readable_decimal(low) + " to " +
         std::to_string(static_cast<std::int64_t>(high)) + ", but is " + std::to_string(value);
}

}  // namespace merkel
