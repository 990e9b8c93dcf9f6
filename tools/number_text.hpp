#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include <fmt/core.h>

namespace merkel {

/// A number for a sentence: three digits, or all before the decimal point. Never "1.05e+03".
[[nodiscard]] inline std::string number_text(double value, int digits = 3) {
  const bool whole = std::fabs(value) >= std::pow(10.0, digits - 1) - 0.05;
  return whole ? fmt::format("{:.0f}", value) : fmt::format("{:.{}g}", value, digits);
}

/// "1 tick", "2 ticks".
[[nodiscard]] inline std::string counted(std::uint64_t count, std::string_view noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

/// The verb of a counted noun: "was" or "were".
[[nodiscard]] inline const char* was(std::uint64_t count) noexcept {
  return count == 1 ? "was" : "were";
}

}  // namespace merkel
