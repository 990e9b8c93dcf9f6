#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace merkel {

/// The number that a text is, with nothing around it; empty for any other text and for a number
/// that does not fit. \param base  of a whole number, if not 10
template <class Number, class... Base>
[[nodiscard]] std::optional<Number> parsed_number(std::string_view text, Base... base) noexcept {
  Number number{};
  const char* const end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, number, base...);
  if (result.ec != std::errc{} || result.ptr != end) return std::nullopt;
  return number;
}

}  // namespace merkel
