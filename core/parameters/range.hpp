#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>

namespace merkel {

/// The allowed values of a parameter. NaN is never allowed.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool above_low = false;                        ///< low itself is not in the range
  bool below_high = false;                       ///< high itself is not in the range
  bool or_infinite = false;                      ///< +infinity is allowed, whatever `high` is
  std::span<const std::string_view> words = {};  ///< of a choice

  [[nodiscard]] bool holds(double value) const noexcept;
  /// For display, for example "> 0 to 1000, or inf"; empty if any value is allowed.
  [[nodiscard]] std::string text() const;
  /// The error in a number: "must be …, but is …"; empty if the number is valid.
  [[nodiscard]] std::string fault(double value) const;
  [[nodiscard]] std::string fault(std::int64_t value) const;
};

/// 0 < value ≤ most.
[[nodiscard]] constexpr Range positive(double most) noexcept {
  return {.low = 0.0, .high = most, .above_low = true};
}
/// The same, or +infinity, which means "flat", "unlimited" or "absent".
[[nodiscard]] constexpr Range positive_or_infinite(double most) noexcept {
  return {.low = 0.0, .high = most, .above_low = true, .or_infinite = true};
}
/// 0 ≤ value ≤ most.
[[nodiscard]] constexpr Range not_negative(double most) noexcept {
  return {.low = 0.0, .high = most};
}
[[nodiscard]] constexpr Range from_to(double low, double high) noexcept {
  return {.low = low, .high = high};
}
/// low ≤ value < high.
[[nodiscard]] constexpr Range from_below(double low, double high) noexcept {
  return {.low = low, .high = high, .below_high = true};
}
[[nodiscard]] constexpr Range one_of(std::span<const std::string_view> words) noexcept {
  return {.words = words};
}
/// For switches, texts and seeds.
[[nodiscard]] constexpr Range any_value() noexcept { return {}; }

/// The shortest decimal that reads back as the same double, without an exponent from 1e-4 to 1e7.
[[nodiscard]] std::string readable_decimal(double value);
/// The shortest decimal that reads back as the same double.
[[nodiscard]] std::string shortest_decimal(double value);

}  // namespace merkel
