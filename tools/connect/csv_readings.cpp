#include "tools/connect/csv_readings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "core/records/readings.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/csv_text_style.hpp"
#include "drivers/uri.hpp"
#include "tools/connect/array_scene.hpp"
#include "tools/connect/text_rows.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMinLines = 5;
constexpr std::size_t kMinFrames = 2;
constexpr std::size_t kMaxReadings = 4;
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

/// The names in the header among the lines, if one names that many columns.
std::vector<std::string> headings_of(const std::vector<std::string>& lines, const CsvStyle& style,
                                     std::size_t columns) {
  for (const std::string& line : lines) {
    if (parse_csv_field(line, false).number) continue;
    std::vector<std::string> names = csv_columns_of_header(csv_cells_of(line, style.separator));
    if (names.size() == columns) return names;
  }
  return {};
}

/// A column as far as the lines describe it.
struct ColumnInLines {
  std::string name;           ///< as in the option columns; empty: the unit is not stated
  std::string quantity = {};  ///< if the unit is not stated; empty: not stated either
  std::string key = {};       ///< what the rows call it; empty: nothing
  double value = std::numeric_limits<double>::quiet_NaN();  ///< the last one; NaN: it had none
  bool decimals = false;                                    ///< one of its numbers has some
};

std::vector<ColumnInLines> described(const TextColumns& text,
                                     const std::vector<std::string>& headings, double seconds) {
  std::vector<std::string> labels = text.keys;
  std::vector<std::string> units;
  for (const auto& fields : text.fields) {
    const CsvField first = fields.empty() ? CsvField{} : fields.front();
    if (text.keys.empty()) labels.emplace_back(first.label);
    units.emplace_back(first.unit);
  }
  const std::vector<std::string> stated =
      headings.empty() ? csv_columns_of_labels(labels, units) : headings;
  std::vector<ColumnInLines> columns;
  for (std::size_t i = 0; i < text.fields.size(); ++i) {
    const std::vector<CsvField>& fields = text.fields[i];
    std::vector<double> values;
    for (const CsvField& field : fields) {
      if (field.number) values.push_back(*field.number);
    }
    // A header names a sensor that has no value, too.
    ColumnInLines column{.name = headings.empty() ? "-" : stated[i]};
    if (!values.empty()) {
      column.value = values.back();
      column.decimals = std::any_of(fields.begin(), fields.end(),
                                    [](const CsvField& field) { return field.decimals; });
      if (!text.keys.empty()) column.key = labels[i];
      column.name = stated[i];
      const std::string quantity = csv_quantity_of(labels[i]);
      const bool counter = quantity != "seq" || !column.decimals;  // not the finger "index"
      const bool open = headings.empty() && units[i].empty() &&
                        (labels[i].empty() || quantity != "-" || !column.key.empty());
      if (column.name == "seq" && !counter) column.name = "-";
      if (column.name == "-" && open) {
        column.name = column_by_growth(values, seconds);
        if (column.name.empty() && quantity != "-" && counter) column.quantity = quantity;
      }
    }
    columns.push_back(std::move(column));
  }
  return columns;
}

/// True for what a name in the option columns of a URI may be.
bool fits_uri(const std::string& key) {
  return !key.empty() && key.find_first_of(",:&?#*|=") == std::string::npos;
}

/// A column in the option columns, with its key if the name does not tell.
std::string entry_of(const ColumnInLines& column, const std::string& name) {
  const std::string_view stem = std::string_view(name).substr(0, name.rfind('_'));
  const bool told = column.key.empty() || name == "-" || column.key == name || column.key == stem ||
                    csv_quantity_of(column.key) == stem || !fits_uri(column.key);
  return told ? name : column.key + ":" + name;
}

/// Unnamed columns of numbers with decimals: the forces of a hand, if there are several.
std::vector<std::size_t> unnamed_measurements(const std::vector<ColumnInLines>& columns) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const ColumnInLines& column = columns[i];
    if (column.name.empty() && column.quantity.empty() && column.decimals) places.push_back(i);
  }
  return places;
}

/// Unnamed columns beside each other: the taxels of an array, if there are many. Empty: they are
/// not beside each other.
std::vector<std::size_t> unnamed_taxels(const std::vector<ColumnInLines>& columns) {
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
  return column && column->kind == CsvColumn::Kind::kValue && is_named(column->channel) &&
         column->quantity != Quantity::kSync;
}

/// The names of the columns if forces without a unit are in `force_unit`, and the first column
/// without a name is `unnamed`.
std::vector<std::string> names_with(const std::vector<ColumnInLines>& columns,
                                    const std::string& unnamed, const std::string& force_unit) {
  std::vector<std::string> names;
  bool measures = std::any_of(columns.begin(), columns.end(), [](const ColumnInLines& column) {
    return is_measured(column.name) || is_measured(column.quantity);
  });
  for (const ColumnInLines& column : columns) {
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

/// The only press of a device is its force or depth, whatever it is called.
void name_the_only_press(const std::vector<ColumnInLines>& columns,
                         std::vector<std::string>& names) {
  std::size_t only = names.size();
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!is_measured(names[i])) continue;
    const auto column = csv_column_named(names[i]);
    if (only != names.size() || !is_named(column->channel) ||
        column->quantity == Quantity::kPressure)
      return;
    only = i;
  }
  if (only == names.size() || columns[only].key.empty()) return;
  const auto column = csv_column_named(names[only]);
  names[only] = (column->quantity == Quantity::kForce ? "force" : "depth") +
                names[only].substr(names[only].rfind('_'));
}

Reading reading_of(const std::vector<ColumnInLines>& columns, std::vector<std::string> names,
                   const std::string& style) {
  name_the_only_press(columns, names);
  std::vector<std::string> entries;
  for (std::size_t i = 0; i < names.size(); ++i) entries.push_back(entry_of(columns[i], names[i]));
  Reading reading{.columns = csv_list_of(entries), .style = style};
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (columns[i].name.empty() && names[i] != "-") reading.assumed.push_back(names[i]);
  }
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
                       is_named(column->channel) && column->quantity != Quantity::kSync;
    if (names[i] == "-" || taxel) continue;
    reading.meaning += (reading.meaning.empty() ? "" : ", ") + names[i] + " = " +
                       shortest_decimal(columns[i].value);
  }
  return reading;
}

}  // namespace

std::vector<Reading> readings_of_lines(std::vector<std::string> lines, double seconds) {
  std::vector<Reading> readings;
  const std::size_t frame_lines = join_frames(lines);
  const auto with_digits = std::count_if(lines.begin(), lines.end(), [](const std::string& line) {
    return line.find_first_of("0123456789") != std::string::npos;
  });
  if (static_cast<std::size_t>(with_digits) < (frame_lines > 0 ? kMinFrames : kMinLines)) {
    return readings;
  }
  for (const TextColumns& text : columns_of_lines(lines)) {
    const auto columns =
        described(text, headings_of(lines, text.style, text.fields.size()), seconds);
    const std::string style =
        text.options + (frame_lines > 0 ? "&frame_lines=" + std::to_string(frame_lines) : "");
    const auto push = [&](const std::vector<std::string>& names) {
      Reading reading = reading_of(columns, names, style);
      const bool repeated =
          std::any_of(readings.begin(), readings.end(), [&](const Reading& other) {
            return other.columns == reading.columns && other.style == reading.style;
          });
      const bool usable = csv_columns_named(reading.columns, ',').has_value() &&
                          Uri::parse("serial:?" + reading.options()).has_value();
      if (!repeated && usable) readings.push_back(reading);
    };
    const auto add = [&](const std::string& unnamed, const std::string& force_unit) {
      const std::vector<std::string> names = names_with(columns, unnamed, force_unit);
      if (std::any_of(names.begin(), names.end(), is_measured)) push(names);
    };
    // No fingertip bears more: such a number is likelier in grams.
    const bool heavy = std::any_of(columns.begin(), columns.end(), [](const ColumnInLines& column) {
      return column.name.empty() && std::fabs(column.value) > kHardPress_N;
    });
    const auto taxels = unnamed_taxels(columns);
    if (taxels.size() >= kMinTaxels) {
      for (const std::string unit : {"_kPa", "_N"}) {
        std::vector<std::string> names = names_with(columns, "", "N");
        for (std::size_t k = 0; k < taxels.size(); ++k) {
          names[taxels[k]] = "taxel" + std::to_string(k + 1) + unit;
        }
        push(names);
      }
    }
    const auto several = unnamed_measurements(columns);
    const bool keyed = !several.empty() && !columns[several.front()].key.empty();
    if (several.size() >= (keyed ? 2 : kSeveral) && several.size() <= ProbeColumns::kMaxFurther) {
      const std::string unit = heavy ? "_g" : "_N";
      std::vector<std::string> names = names_with(columns, "", "N");
      for (std::size_t k = 0; k < several.size(); ++k) {
        names[several[k]] =
            (keyed && fits_uri(columns[several[k]].key) ? columns[several[k]].key
                                                        : "force" + std::to_string(k + 1)) +
            unit;
      }
      push(names);
    }
    if (taxels.size() < kMinTaxels) {
      add("force", heavy ? "g" : "N");
      add("depth", heavy ? "g" : "N");
      add("force", heavy ? "N" : "g");
    }
    // Only commas that could be decimal points allow another interpretation.
    const bool ambiguous = text.style == CsvStyle{',', false} && columns.size() == 2 &&
                           text.keys.empty() && text.fields[0].front().label.empty() &&
                           text.fields[1].front().unit.empty() && columns[0].name.empty() &&
                           columns[1].name.empty();
    if (!readings.empty() && !ambiguous) break;
  }
  if (readings.size() > kMaxReadings) readings.resize(kMaxReadings);
  return readings;
}

}  // namespace merkel
