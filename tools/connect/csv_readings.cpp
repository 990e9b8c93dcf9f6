#include "tools/connect/csv_readings.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "core/records/probe_sample.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/csv_text_style.hpp"
#include "tools/connect/array_scene.hpp"

namespace merkel {
namespace {

constexpr std::size_t kLeastLines = 5;
constexpr std::size_t kMostReadings = 4;
constexpr std::size_t kSeveral = 3;  ///< sensors, rather than one with force and depth
constexpr double kHardPress_N = 20.0;

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

/// The fields of lines in a style, column by column; lines with other columns are left out.
std::vector<std::vector<CsvField>> columns_of(const std::vector<std::string>& lines,
                                              const CsvStyle& style) {
  std::vector<std::vector<CsvField>> columns;
  for (const std::string& line : lines) {
    const std::vector<CsvField> fields = csv_fields_of(line, style);
    const auto is_number = [](const CsvField& field) { return field.number.has_value(); };
    if (std::none_of(fields.begin(), fields.end(), is_number)) continue;
    if (columns.empty()) columns.resize(fields.size());
    if (columns.size() != fields.size()) continue;
    for (std::size_t i = 0; i < fields.size(); ++i) columns[i].push_back(fields[i]);
  }
  return columns;
}

/// The names in the header among the lines, if one names that many columns.
std::vector<std::string> headings_of(const std::vector<std::string>& lines, const CsvStyle& style,
                                     std::size_t columns) {
  for (const std::string& line : lines) {
    if (parse_csv_field(line, false).number) continue;
    std::vector<std::string> names = csv_columns_of_header(line, style.separator);
    if (names.size() == columns) return names;
  }
  return {};
}

/// A column as far as the lines describe it.
struct Column {
  std::string name;       ///< as in the option columns; empty: the unit is not stated
  std::string quantity;   ///< if the unit is not stated; empty: not stated either
  double value = 0.0;     ///< the last one
  bool decimals = false;  ///< one of its numbers has some
};

std::vector<Column> described(const std::vector<std::vector<CsvField>>& fields,
                              const std::vector<std::string>& headings, double seconds) {
  std::vector<Column> columns;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    std::vector<double> values;
    for (const CsvField& field : fields[i]) {
      if (field.number) values.push_back(*field.number);
    }
    Column column{.name = "-", .quantity = {}};
    if (!values.empty()) {
      column.value = values.back();
      column.decimals = std::any_of(fields[i].begin(), fields[i].end(),
                                    [](const CsvField& field) { return field.decimals; });
      column.name = headings.empty() ? csv_column_of(fields[i].front()) : headings[i];
      if (column.name.empty()) column.quantity = csv_quantity_of(fields[i].front().label);
      if (column.name.empty()) column.name = column_by_growth(values, seconds);
    }
    columns.push_back(std::move(column));
  }
  std::vector<std::string> names;
  std::vector<CsvField> labels;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    names.push_back(columns[i].name);
    labels.push_back(fields[i].empty() ? CsvField{} : fields[i].front());
  }
  if (headings.empty()) tell_csv_columns_apart(names, labels);
  for (std::size_t i = 0; i < columns.size(); ++i) columns[i].name = names[i];
  return columns;
}

/// Unnamed columns of numbers with decimals: the forces of a hand, if there are several.
std::vector<std::size_t> unnamed_measurements(const std::vector<Column>& columns) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const Column& column = columns[i];
    if (column.name.empty() && column.quantity.empty() && column.decimals) places.push_back(i);
  }
  return places;
}

/// Unnamed columns beside each other: the taxels of an array, if there are many. Empty: they are
/// not beside each other.
std::vector<std::size_t> unnamed_taxels(const std::vector<Column>& columns) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (!columns[i].name.empty() || !columns[i].quantity.empty()) continue;
    if (!places.empty() && places.back() + 1 != i) return {};
    places.push_back(i);
  }
  return places;
}

bool is_measured(std::string_view name) {
  if (name.starts_with("force") || name.starts_with("depth")) return true;
  const auto column = csv_column_named(name);
  return column && column->kind == CsvColumn::Kind::kValue && is_named(column->channel);
}

/// The names of the columns if forces without a unit are in `force_unit`, and the first column
/// without a name is `unnamed`.
std::vector<std::string> names_with(const std::vector<Column>& columns, const std::string& unnamed,
                                    const std::string& force_unit) {
  std::vector<std::string> names;
  bool measures = std::any_of(columns.begin(), columns.end(), [](const Column& column) {
    return is_measured(column.name) || is_measured(column.quantity);
  });
  for (const Column& column : columns) {
    std::string name = column.name;
    if (name.empty()) {
      const std::string quantity = column.quantity.empty() && !measures ? unnamed : column.quantity;
      measures = measures || is_measured(quantity);
      name = quantity.empty() || quantity == "time"
                 ? "-"
                 : quantity + "_" + (quantity.starts_with("force") ? force_unit : "mm");
    }
    names.push_back(std::move(name));
  }
  return names;
}

std::string options_of(const CsvStyle& style) {
  return "&separator=" + std::string(name_of_separator(style.separator)) +
         "&decimal=" + (style.decimal_comma ? "comma" : "point");
}

Reading reading_of(const std::vector<Column>& columns, const std::vector<std::string>& names,
                   const CsvStyle& style) {
  Reading reading{.columns = csv_list_of(names), .style = options_of(style), .meaning = {}};
  const std::vector<std::string> channels = channels_in(reading.columns);
  const std::size_t taxels = taxels_among(channels);
  if (taxels > 0) {
    const bool pressures = std::any_of(channels.begin(), channels.end(), [](const auto& channel) {
      return channel.ends_with("_kPa");
    });
    reading.meaning =
        "a tactile array of " + std::to_string(taxels) + " taxels in " + (pressures ? "kPa" : "N");
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto column = csv_column_named(names[i]);
    const bool taxel = taxels > 0 && column && column->kind == CsvColumn::Kind::kValue &&
                       is_named(column->channel);
    if (names[i] == "-" || taxel) continue;
    reading.meaning += (reading.meaning.empty() ? "" : ", ") + names[i] + " = " +
                       shortest_decimal(columns[i].value);
  }
  return reading;
}

}  // namespace

std::vector<Reading> readings_of_lines(const std::vector<std::string>& lines, double seconds) {
  std::vector<Reading> readings;
  const auto with_digits = std::count_if(lines.begin(), lines.end(), [](const std::string& line) {
    return line.find_first_of("0123456789") != std::string::npos;
  });
  if (static_cast<std::size_t>(with_digits) < kLeastLines) return readings;
  for (const CsvStyle& style : csv_styles(lines)) {
    const auto fields = columns_of(lines, style);
    const auto columns = described(fields, headings_of(lines, style, fields.size()), seconds);
    const auto add = [&](const std::string& unnamed, const std::string& force_unit) {
      const std::vector<std::string> names = names_with(columns, unnamed, force_unit);
      const bool measures = std::any_of(names.begin(), names.end(), is_measured);
      Reading reading = reading_of(columns, names, style);
      const bool repeated =
          std::any_of(readings.begin(), readings.end(), [&](const Reading& other) {
            return other.columns == reading.columns && other.style == reading.style;
          });
      if (measures && !repeated) readings.push_back(std::move(reading));
    };
    // No fingertip bears more: such a number is likelier in grams.
    const bool heavy = std::any_of(columns.begin(), columns.end(), [](const Column& column) {
      return column.name.empty() && std::fabs(column.value) > kHardPress_N;
    });
    const auto taxels = unnamed_taxels(columns);
    if (taxels.size() >= kFewestTaxels) {
      for (const std::string unit : {"_kPa", "_N"}) {
        std::vector<std::string> names = names_with(columns, "", "N");
        for (std::size_t k = 0; k < taxels.size(); ++k) {
          names[taxels[k]] = "taxel" + std::to_string(k + 1) + unit;
        }
        readings.push_back(reading_of(columns, names, style));
      }
    }
    const auto several = unnamed_measurements(columns);
    if (several.size() >= kSeveral && several.size() <= ProbeColumns::kMostFurther) {
      const std::string unit = heavy ? "_g" : "_N";
      std::vector<std::string> names = names_with(columns, "", "N");
      for (std::size_t k = 0; k < several.size(); ++k) {
        names[several[k]] = "force" + std::to_string(k + 1) + unit;
      }
      readings.push_back(reading_of(columns, names, style));
    }
    if (taxels.size() < kFewestTaxels) {
      add("force", heavy ? "g" : "N");
      add("depth", heavy ? "g" : "N");
      add("force", heavy ? "N" : "g");
    }
    // Only commas that could be decimal points allow another interpretation.
    const bool ambiguous = style == CsvStyle{',', false} && columns.size() == 2 &&
                           fields[0].front().label.empty() && fields[1].front().unit.empty() &&
                           columns[0].name.empty() && columns[1].name.empty();
    if (!readings.empty() && !ambiguous) break;
  }
  if (readings.size() > kMostReadings) readings.resize(kMostReadings);
  return readings;
}

}  // namespace merkel
