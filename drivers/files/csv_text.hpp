#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace merkel {

[[nodiscard]] constexpr bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

/// Removes the text up to the next comma from `rest` and returns it without surrounding blanks.
[[nodiscard]] std::string_view take_field(std::string_view& rest) noexcept;

/// A whole field times 10^shift, as the nearest double, so that a change of unit adds no rounding
/// error. Reads "nan" and "inf"; an overflow becomes inf.
[[nodiscard]] std::optional<double> parse_number(std::string_view field, int shift = 0) noexcept;

/// The shortest decimal that parse_number(…, -shift) reads back as the same double.
[[nodiscard]] std::string shifted_decimal(double value, int shift);

/// A text without the UTF-8 byte order mark at its beginning, if it has one.
[[nodiscard]] inline std::string_view without_byte_order_mark(std::string_view text) noexcept {
  return text.substr(text.starts_with("\xEF\xBB\xBF") ? 3 : 0);
}

/// A whole field of time as nanoseconds, exact; decimals below a nanosecond are rounded. Empty if
/// it is not a finite number within ±4e9 s, the range in which the difference of any two times
/// fits. \param unit_ns  of the field: a power of ten from 1 to 1e9
[[nodiscard]] std::optional<std::chrono::nanoseconds> parse_time(std::string_view field,
                                                                 std::int64_t unit_ns) noexcept;
[[nodiscard]] inline std::optional<std::chrono::nanoseconds> parse_seconds(
    std::string_view field) noexcept {
  return parse_time(field, 1'000'000'000);
}

/// Appends seconds with nine decimals.
void append_seconds(std::string& text, std::chrono::nanoseconds time);
/// Appends milliseconds with six decimals.
void append_milliseconds(std::string& text, std::chrono::nanoseconds time);

}  // namespace merkel
