#include "drivers/protocols/number_with_unit.hpp"

#include "drivers/files/csv_text.hpp"

namespace merkel {
namespace {

constexpr std::string_view kBetween = " \t,;";

void skip(std::string_view& rest, std::string_view characters) noexcept {
  const auto first = rest.find_first_not_of(characters);
  rest.remove_prefix(first == std::string_view::npos ? rest.size() : first);
}

}  // namespace

std::optional<NumberWithUnit> take_number_with_unit(std::string_view& rest) noexcept {
  skip(rest, kBetween);
  const auto end = rest.find_first_not_of("+-.0123456789");
  const std::string_view digits = rest.substr(0, end);
  const auto value = parse_number(digits);
  if (!value) return std::nullopt;
  rest.remove_prefix(digits.size());
  skip(rest, " \t");
  std::size_t letters = 0;
  while (letters < rest.size() && ((rest[letters] >= 'a' && rest[letters] <= 'z') ||
                                   (rest[letters] >= 'A' && rest[letters] <= 'Z'))) {
    ++letters;
  }
  const std::string_view unit = rest.substr(0, letters);
  rest.remove_prefix(letters);
  skip(rest, kBetween);
  return NumberWithUnit{.value = *value, .unit = unit};
}

}  // namespace merkel
