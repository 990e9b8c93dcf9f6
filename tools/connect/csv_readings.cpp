#include "tools/connect/csv_readings.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "drivers/protocols/csv_text_style.hpp"

namespace merkel {
namespace {

constexpr std::size_t kLeastLines = 5;

/// Classifies a column of numbers by its growth: a counter, a clock, or a measurement.
std::string column_by_growth(const std::vector<double>& values, double seconds) {
  bool rises = values.size() > 2;
  bool counts = rises;
  for (std::size_t i = 1; i < values.size(); ++i) {
    rises = rises && values[i] > values[i - 1];
    counts = counts && values[i] == values[i - 1] + 1.0;
  }
  if (counts) return "seq";
  if (!rises || seconds <= 0.0) return {};
  const double rate = (values.back() - values.front()) / seconds;
  for (const auto& [name, nominal] :
       {std::pair("time_us", 1e6), std::pair("time_ms", 1e3), std::pair("time_s", 1.0)}) {
    if (rate > nominal * 0.5 && rate < nominal * 2.0) return name;
  }
  return {};
}

/// The columns of lines in a style; empty if the lines differ in their columns.
std::vector<std::vector<CsvField>> fields_of(const std::vector<std::string>& lines,
                                             const CsvStyle& style) {
  std::vector<std::vector<CsvField>> columns;
  for (const std::string& line : lines) {
    std::vector<CsvField> fields;
    bool numbers = true;
    for (std::string_view rest = line; !rest.empty();) {
      fields.push_back(parse_csv_field(take_csv_part(rest, style.separator), style.decimal_comma));
      numbers = numbers && fields.back().number;
    }
    if (!numbers || fields.empty()) continue;
    if (columns.empty()) columns.resize(fields.size());
    if (columns.size() != fields.size()) continue;
    for (std::size_t i = 0; i < fields.size(); ++i) columns[i].push_back(fields[i]);
  }
  return columns;
}

}  // namespace

std::vector<Reading> readings_of_lines(const std::vector<std::string>& lines, double seconds) {
  std::vector<Reading> readings;
  const auto with_digits = std::count_if(lines.begin(), lines.end(), [](const std::string& line) {
    return line.find_first_of("0123456789") != std::string::npos;
  });
  if (static_cast<std::size_t>(with_digits) < kLeastLines) return readings;
  for (const CsvStyle& style : csv_styles(lines)) {
    const auto columns = fields_of(lines, style);
    std::string names;
    std::string other;  // the same with another unit where none is given
    std::string meaning;
    std::string other_meaning;
    bool certain = true;
    bool measures = false;
    for (const auto& column : columns) {
      std::vector<double> values;
      for (const CsvField& field : column) values.push_back(*field.number);
      std::string name = csv_column_of(column.front());
      if (name.empty()) name = column_by_growth(values, seconds);
      std::string second = name;
      if (name.empty() && measures) name = second = "-";
      if (name.empty()) {
        name = "force_N";
        second = "depth_mm";
        certain = false;
      }
      const bool measured = name.starts_with("force") || name.starts_with("depth");
      measures = measures || measured;
      const auto add = [](std::string& list, const std::string& item, const char* between) {
        list += (list.empty() ? "" : between) + item;
      };
      add(names, name, ",");
      add(other, second, ",");
      const std::string value = shortest_decimal(values.back());
      add(meaning, name + " = " + value, ", ");
      add(other_meaning, second + " = " + value, ", ");
    }
    if (!measures) continue;
    const std::string tail = "&separator=" + std::string(name_of_separator(style.separator)) +
                             "&decimal=" + (style.decimal_comma ? "comma" : "point");
    readings.push_back({.options = "protocol=csv&columns=" + names + tail, .meaning = meaning});
    if (!certain) {
      readings.push_back(
          {.options = "protocol=csv&columns=" + other + tail, .meaning = other_meaning});
    }
    // Only commas that could be decimal points allow another interpretation.
    const bool ambiguous = style == CsvStyle{',', false} && columns.size() == 2 &&
                           columns[0].front().label.empty() && columns[1].front().unit.empty();
    if (!ambiguous || readings.size() > 1) break;
  }
  if (readings.size() > 2) readings.resize(2);
  return readings;
}

}  // namespace merkel
