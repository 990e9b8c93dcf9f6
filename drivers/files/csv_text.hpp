#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

namespace merkel {

/// Takes the text up to the next comma off `rest`, without surrounding blanks.
[[nodiscard]] std::string_view take_field(std::string_view& rest) noexcept;

/// A whole field, times ten to the power of `shift`, as the nearest double: a change of unit costs
/// no rounding. "nan" and "inf" are read as such; what is too large becomes inf.
[[nodiscard]] std::optional<double> parse_number(std::string_view field, int shift = 0) noexcept;

/// The shortest decimal that parse_number(…, -shift) reads back as the same double.
[[nodiscard]] std::string shifted_decimal(double value, int shift);

/// A whole field of seconds as nanoseconds, exact to the digit: decimals beyond the ninth are
/// rounded. Nothing where it is not a finite number within ±4e9 s, so that the difference of any
/// two times fits.
[[nodiscard]] std::optional<std::chrono::nanoseconds> parse_seconds(
    std::string_view field) noexcept;

/// Seconds with nine decimals.
void append_seconds(std::string& text, std::chrono::nanoseconds time);
/// Milliseconds with six decimals.
void append_milliseconds(std::string& text, std::chrono::nanoseconds time);

}  // namespace merkel
