#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace merkel {

/// The style of lines of numbers: "0.300,12", "0,300;12", "Force: 0.300 N".
struct CsvStyle {
  char separator = ',';  ///< ',', ';', tab or ' '
  bool decimal_comma = false;

  friend bool operator==(const CsvStyle&, const CsvStyle&) = default;
};

/// One field of such a line: a number optionally with a label before it and a unit after it.
struct CsvField {
  std::string_view label;  ///< without ':' or '='; empty: none
  std::optional<double> number;
  std::string_view unit;  ///< empty: none
};

/// Removes the text up to the next separator from `rest` and returns it without surrounding blanks.
/// Several blanks are one separator.
[[nodiscard]] std::string_view take_csv_part(std::string_view& rest, char separator) noexcept;

/// Reads one field. Text without a number is a label.
[[nodiscard]] CsvField parse_csv_field(std::string_view text, bool decimal_comma) noexcept;

/// All styles in which every field of the lines is a number, likeliest first. \param lines  without
/// their line ends; lines without a digit are ignored
[[nodiscard]] std::vector<CsvStyle> csv_styles(const std::vector<std::string>& lines);

/// The column that a field's label and unit name, as in the option `columns` ("force_N"); "-" if
/// they name something else, empty if there are none.
[[nodiscard]] std::string csv_column_of(const CsvField& field);

/// "comma", "semicolon", "tab" or "space".
[[nodiscard]] std::string_view name_of_separator(char separator) noexcept;

}  // namespace merkel
