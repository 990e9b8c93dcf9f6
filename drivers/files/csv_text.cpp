#include "drivers/files/csv_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/take_part.hpp"

namespace merkel {
namespace {

constexpr std::int64_t kPerSecond = 1'000'000'000;
constexpr std::int64_t kLargestSeconds =
    4'000'000'000;  ///< the difference of two times fits into 64-bit nanoseconds

bool is_number_end(char c) noexcept { return is_digit(c) || c == '.'; }

/// A whole number of nanoseconds with the decimal point before its last `decimals` digits.
void append_decimal(std::string& text, std::chrono::nanoseconds time, std::size_t decimals) {
  const std::int64_t count = time.count();
  const auto magnitude =
      count < 0 ? 0 - static_cast<std::uint64_t>(count) : static_cast<std::uint64_t>(count);
  std::array<char, 24> digits{};
  auto* const end = std::to_chars(digits.data(), digits.data() + digits.size(), magnitude).ptr;
  std::string whole(digits.data(), end);
  if (whole.size() <= decimals) whole.insert(0, decimals + 1 - whole.size(), '0');
  if (count < 0) text += '-';
  text.append(whole, 0, whole.size() - decimals);
  text += '.';
  text.append(whole, whole.size() - decimals);
}

}  // namespace

std::string_view take_field(std::string_view& rest) noexcept {
  const std::string_view field = take_part(rest, ',');
  constexpr std::string_view kBlanks = " \t";
  const auto first = field.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return field.substr(first, field.find_last_not_of(kBlanks) - first + 1);
}

std::optional<double> parse_number(std::string_view field, int shift) noexcept {
  if (field.starts_with('+')) field.remove_prefix(1);
  std::array<char, 64> shifted{};
  double scale = 1.0;
  if (shift != 0) {
    const auto mark = field.find_first_of("eE");
    const std::string_view mantissa = field.substr(0, mark);
    int exponent = 0;
    if (mark != std::string_view::npos) {
      std::string_view digits = field.substr(mark + 1);
      if (digits.starts_with('+')) digits.remove_prefix(1);
      const char* const end = digits.data() + digits.size();
      const auto result = std::from_chars(digits.data(), end, exponent);
      if (result.ec != std::errc{} || result.ptr != end) return std::nullopt;
    }
    if (!mantissa.empty() && is_number_end(mantissa.back()) && mantissa.size() < 48 &&
        std::abs(exponent) < 10000) {
      char* out = std::copy(mantissa.begin(), mantissa.end(), shifted.data());
      *out++ = 'e';
      out = std::to_chars(out, shifted.data() + shifted.size(), exponent + shift).ptr;
      field = {shifted.data(), static_cast<std::size_t>(out - shifted.data())};
    } else {
      scale = std::pow(10.0, shift);
    }
  }
  double value = 0.0;
  const char* const end = field.data() + field.size();
  const auto result = std::from_chars(field.data(), end, value);
  if (result.ptr != end || field.empty()) return std::nullopt;
  if (result.ec == std::errc::result_out_of_range) {
    return field.find("e-") == std::string_view::npos ? HUGE_VAL : 0.0;
  }
  if (result.ec != std::errc{}) return std::nullopt;
  return value * scale;
}

std::string shifted_decimal(double value, int shift) {
  if (shift == 0 || !std::isfinite(value)) return shortest_decimal(value);
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::scientific)
          .ptr;
  const std::string exact(text.data(), end);
  const auto nearest = parse_number(exact, shift);
  std::string plain = shortest_decimal(nearest.value_or(value));
  if (parse_number(plain, -shift) == value) return plain;
  // No double of the other unit is exact: convert the digits.
  const auto mark = exact.find('e');
  const int exponent = std::stoi(exact.substr(mark + 1)) + shift;
  return exact.substr(0, mark) + "e" + std::to_string(exponent);
}

std::optional<std::chrono::nanoseconds> parse_time(std::string_view field,
                                                   std::int64_t unit_ns) noexcept {
  const std::int64_t largest = kLargestSeconds * (kPerSecond / unit_ns);
  std::string_view rest = field;
  const bool negative = rest.starts_with('-');
  if (negative || rest.starts_with('+')) rest.remove_prefix(1);
  std::int64_t whole = 0;
  std::int64_t fraction = 0;
  std::size_t digits = 0;
  while (!rest.empty() && is_digit(rest.front()) && whole < largest) {
    whole = whole * 10 + (rest.front() - '0');
    rest.remove_prefix(1);
    ++digits;
  }
  if (rest.starts_with('.')) {
    rest.remove_prefix(1);
    std::int64_t place = unit_ns / 10;
    while (!rest.empty() && is_digit(rest.front())) {
      const std::int64_t digit = rest.front() - '0';
      fraction += place > 0 ? digit * place : 0;
      if (place == 0 && digit >= 5) ++fraction;
      place = place > 0 ? place / 10 : -1;  // only the next decimal decides the rounding
      rest.remove_prefix(1);
      ++digits;
    }
  }
  if (rest.empty() && digits > 0 && whole < largest) {
    const std::int64_t time_ns = whole * unit_ns + fraction;
    return std::chrono::nanoseconds{negative ? -time_ns : time_ns};
  }
  // An exponent, or not a number.
  const auto count = parse_number(field);
  if (!count || !(std::fabs(*count) < static_cast<double>(largest))) return std::nullopt;
  return units::nanoseconds_from_s(*count * (static_cast<double>(unit_ns) * 1e-9));
}

void append_seconds(std::string& text, std::chrono::nanoseconds time) {
  append_decimal(text, time, 9);
}

void append_milliseconds(std::string& text, std::chrono::nanoseconds time) {
  append_decimal(text, time, 6);
}

}  // namespace merkel
