#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/protocols/unit_factors.hpp"

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
  bool decimals = false;  ///< the number is written with decimals, as 0.00 is
};

/// Removes the text up to the next separator from `rest` and returns it without surrounding blanks.
/// Several blanks are one separator.
[[nodiscard]] std::string_view take_csv_part(std::string_view& rest, char separator) noexcept;

/// True if an empty field may follow the last separator: it does where a field is missing, but not
/// where all lines end with a separator.
[[nodiscard]] constexpr bool ends_in_separator(std::string_view line, char separator) noexcept {
  return separator != ' ' && line.ends_with(separator);
}

/// Reads one field. Text without a number is a label.
[[nodiscard]] CsvField parse_csv_field(std::string_view text, bool decimal_comma) noexcept;

/// All styles in which the fields of the lines are numbers or labels of the number that follows,
/// likeliest first. \param lines  without their line ends; lines without a digit are ignored
[[nodiscard]] std::vector<CsvStyle> csv_styles(const std::vector<std::string>& lines);

/// For lines that no style reads.
inline constexpr std::string_view kSeparateNumbers =
    "let it print = or : between a name and its number, and a comma between values, as in "
    "F=0.25N,D=1.5mm";
/// kSeparateNumbers, if the lines have numbers and no style reads them; otherwise empty.
[[nodiscard]] std::string csv_advice(const std::vector<std::string>& lines);

/// The fields of a line. A field of text alone labels the number after it: "F,1.5" is "F: 1.5"
/// behind a field to ignore.
[[nodiscard]] std::vector<CsvField> csv_fields_of(std::string_view line, const CsvStyle& style);

/// The quantity that a label means ("force", "force_x", "depth", "x", "time", "seq"); "-" for any
/// other label, empty without a label.
[[nodiscard]] std::string csv_quantity_of(std::string_view label);

/// The column that a field's label and unit name, as in the option `columns` ("force_N", of a
/// pressure "t1_kPa"); "-" if they name something else, empty if there are none.
[[nodiscard]] std::string csv_column_of(const CsvField& field);

/// The column that a field's label and unit name as a channel of its own ("thumb_N"); "-" unless
/// the unit is one of force, length or pressure, or an electrical one with a factor.
[[nodiscard]] std::string csv_own_name_of(const CsvField& field, const UnitFactors& factors = {});

/// Gives columns of the same name the names of their labels, or numbers: two fields "thumb" and
/// "index" in N are not both force_N. A quantity that comes again in another unit is ignored.
void tell_csv_columns_apart(std::vector<std::string>& names, const std::vector<CsvField>& fields,
                            const UnitFactors& factors = {});

/// The field that a cell of a header means: "force_g", "Force (g)" and "Force [g]" have the label
/// force and the unit g.
[[nodiscard]] CsvField parse_csv_heading(std::string_view cell) noexcept;

/// "comma", "semicolon", "tab" or "space".
[[nodiscard]] std::string_view name_of_separator(char separator) noexcept;

}  // namespace merkel
