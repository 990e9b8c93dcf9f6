#include "drivers/protocols/csv_columns.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "drivers/files/csv_text.hpp"
#include "drivers/parsed_number.hpp"
#include "drivers/protocols/csv_text_style.hpp"
#include "drivers/protocols/device_units.hpp"
#include "drivers/protocols/text_row.hpp"

namespace merkel {

using std::chrono::nanoseconds;

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// A number of more digits than a time has.
bool is_endless_number(std::string_view text) noexcept {
  double value = 0.0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool large = result.ec == std::errc::result_out_of_range || std::fabs(value) > 1e20;
  return large && result.ptr == text.data() + text.size();
}

constexpr int kMaxRepeated = 1024;
constexpr std::size_t kWorthShortening = 8;  ///< names in a row

/// A name in a list of columns, "t:time_s" or "time_s".
struct NamedCell {
  std::string_view key;  ///< empty: none
  std::string_view name;

  explicit NamedCell(std::string_view text)
      : key(text.substr(0, std::min(text.rfind(':'), text.size()))), name(text) {
    if (key.size() == text.size()) {
      key = {};
    } else {
      name.remove_prefix(key.size() + 1);
    }
  }
  [[nodiscard]] std::string numbered(std::size_t number) const {
    return (key.empty() ? "" : numbered_column(key, number) + ":") + numbered_column(name, number);
  }
};

/// Adds a name or, for "taxel_kPa*256", as many numbered ones. False if the number is wrong.
bool add_names(std::string_view text, std::vector<std::string>& names) {
  const auto star = text.rfind('*');
  if (star == std::string_view::npos) {
    names.emplace_back(text);
    return true;
  }
  const int count = parsed_number<int>(text.substr(star + 1)).value_or(0);
  if (count < 1 || count > kMaxRepeated) return false;
  const NamedCell cell(text.substr(0, star));
  for (int i = 1; i <= count; ++i) names.push_back(cell.numbered(static_cast<std::size_t>(i)));
  return true;
}

/// "taxel_kPa" of "taxel1_kPa"; empty if it has not the number 1.
std::string without_first_number(std::string_view name) {
  const auto mark = std::min(name.rfind('_'), name.size());
  if (mark == 0 || name[mark - 1] != '1') return {};
  return std::string(name.substr(0, mark - 1)) + std::string(name.substr(mark));
}

/// Numbers the channels with names of their own in the order of their columns.
void number_named_channels(std::vector<CsvColumn>& columns) noexcept {
  std::size_t next = 0;
  for (CsvColumn& column : columns) {
    if (column.kind == CsvColumn::Kind::kValue && is_named(column.channel)) {
      column.channel = named_channel(next++);
    }
  }
}

/// The factor of a number that states its unit; empty: it is no unit of the column.
std::optional<double> stated_factor(const CsvColumn& column, std::string_view unit) {
  const auto stated = unit_named(unit);
  const auto of_column = unit_named(column.name.substr(column.name.rfind('_') + 1));
  if (!stated || !of_column || stated->quantity != of_column->quantity) return std::nullopt;
  return column.factor * stated->factor / of_column->factor;
}

}  // namespace

bool is_sync_name(std::string_view name) noexcept {
  return name.starts_with("sync") &&
         std::all_of(name.begin() + 4, name.end(), [](char c) { return is_digit(c); });
}

void CsvColumn::set_factor(double to_unit) noexcept {
  factor = rest = to_unit;
  power = 0;
  if (!(factor > 0.0)) return;
  const auto nearest = static_cast<int>(std::lround(std::log10(factor)));
  if (std::fabs(factor / std::pow(10.0, nearest) - 1.0) >= 1e-12) return;
  power = nearest;
  rest = 1.0;
}

bool is_electrical_press(std::string_view name) {
  const auto mark = name.rfind('_');
  const auto unit = unit_named(mark == std::string_view::npos ? "" : name.substr(mark + 1));
  const std::string quantity = csv_quantity_of(name.substr(0, mark));
  return unit && unit->is_electrical() && !quantity.empty() && quantity != "-" &&
         quantity != "seq" && quantity != "time";
}

Expected<CsvColumn, std::string> csv_column_named(std::string_view name,
                                                  const UnitFactors& factors) {
  if (name == "-") return CsvColumn{};
  if (name == "seq") return CsvColumn{.kind = CsvColumn::Kind::kSequence, .name = "seq"};
  if (is_sync_name(name)) {
    return CsvColumn{.kind = CsvColumn::Kind::kValue,
                     .name = std::string(name),
                     .channel = named_channel(0),
                     .quantity = Quantity::kSync};
  }
  const auto mark = name.rfind('_');
  std::string_view stem = name.substr(0, mark);
  const std::string_view unit = mark == std::string_view::npos ? "" : name.substr(mark + 1);
  if (stem == "time") {
    for (const auto& [known, ns] : {std::pair<std::string_view, std::int64_t>{"s", 1'000'000'000},
                                    {"ms", 1'000'000},
                                    {"us", 1'000}}) {
      if (unit == known) {
        return CsvColumn{
            .kind = CsvColumn::Kind::kTime, .name = std::string(name), .nanoseconds = ns};
      }
    }
    return Unexpected<std::string>("the unit of " + std::string(name) +
                                   " is unknown: time is in s, ms or us");
  }
  auto measured = unit_named(unit);
  std::string quantity;
  if (measured && measured->is_electrical() && !stem.empty()) {
    if (is_electrical_press(name)) stem = quantity = csv_quantity_of(stem);
    const auto known = factors.of(stem, *measured);
    if (!known) {
      return Unexpected<std::string>(UnitFactors::missing(
          name, *measured, !quantity.empty() && !quantity.starts_with("force")));
    }
    measured = known;
  }
  for (std::size_t i = 0; i < kDeviceChannels; ++i) {
    if (stem != kDeviceChannelNames[i]) continue;
    const auto channel = static_cast<DeviceChannel>(i);
    const bool force = channel <= DeviceChannel::kForceZ;
    if (!measured || measured->quantity != (force ? Quantity::kForce : Quantity::kLength)) {
      return Unexpected<std::string>("the unit of " + std::string(name) + " is unknown: " +
                                     (force ? "forces are in " + std::string(kForceUnits)
                                            : "lengths are in " + std::string(kLengthUnits)));
    }
    CsvColumn column{.kind = CsvColumn::Kind::kValue,
                     .name = std::string(name),
                     .channel = channel,
                     .quantity = measured->quantity};
    column.set_factor(measured->factor);
    return column;
  }
  if (measured && !measured->is_electrical() && !stem.empty()) {
    CsvColumn column{.kind = CsvColumn::Kind::kValue,
                     .name = std::string(name),
                     .channel = named_channel(0),
                     .quantity = measured->quantity};
    column.set_factor(measured->factor);
    return column;
  }
  return Unexpected<std::string>("the column " + std::string(name) +
                                 " is unknown; the known ones are " + csv_column_names());
}

std::string csv_column_names() {
  return "time_s, time_ms, time_us, seq, force_N, force_x_N, force_y_N, force_z_N, depth_mm, x_mm, "
         "y_mm, z_mm, sync (a sync line, 0 or 1), names of your own with a unit, such as thumb_N, and - to ignore a column; "
         "forces are in " +
         std::string(kForceUnits) + ", lengths in " + std::string(kLengthUnits) +
         ", pressures in " + std::string(kPressureUnits) +
         "; or a column is in V, mV, uV or count, with a key such as force_N_per_V"
         "; taxel_kPa*256 is short for taxel1_kPa to taxel256_kPa";
}

std::vector<std::string> csv_names_of(std::string_view names) {
  std::vector<std::string> all;
  for (std::string_view rest = names; !rest.empty();) {
    if (!add_names(take_csv_part(rest, ','), all)) return {};
  }
  return all;
}

std::string csv_list_of(const std::vector<std::string>& names) {
  std::string list;
  for (std::size_t i = 0; i < names.size();) {
    const NamedCell first(names[i]);
    const std::string key = without_first_number(first.key);
    const std::string stem = without_first_number(first.name);
    const std::string pattern = first.key.empty() ? stem : key + ":" + stem;
    std::size_t count = 0;
    if (!stem.empty() && first.key.empty() == key.empty()) {
      const std::size_t most = std::min<std::size_t>(names.size() - i, kMaxRepeated);
      while (count < most && names[i + count] == NamedCell(pattern).numbered(count + 1)) ++count;
    }
    const bool shorten = count >= kWorthShortening;
    list += (i == 0 ? "" : ",") + (shorten ? pattern + "*" + std::to_string(count) : names[i]);
    i += shorten ? count : 1;
  }
  return list;
}

bool same_quantity(const CsvColumn& a, const CsvColumn& b) {
  if (a.kind != b.kind || a.kind == CsvColumn::Kind::kSkip) return false;
  if (a.kind != CsvColumn::Kind::kValue) return true;
  if (is_named(a.channel) != is_named(b.channel)) return false;
  if (!is_named(a.channel)) return a.channel == b.channel;
  const auto stem = [](const std::string& name) {
    return std::string_view(name).substr(0, name.rfind('_'));
  };
  return a.quantity == b.quantity && stem(a.name) == stem(b.name);
}

std::vector<ChannelName> names_of_columns(const std::vector<CsvColumn>& columns) {
  std::vector<ChannelName> names;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const CsvColumn& column = columns[i];
    if (column.kind != CsvColumn::Kind::kValue) continue;
    names.push_back({.name = column.name,
                     .channel = column.channel,
                     .column = i + 1,
                     .quantity = column.quantity,
                     .factor = column.factor});
  }
  return names;
}

std::vector<std::string> csv_cells_of(std::string_view line, char separator) {
  std::vector<std::string> cells;
  while (!line.empty()) cells.emplace_back(take_csv_part(line, separator));
  return cells;
}

std::vector<std::string> csv_columns_of_header(const std::vector<std::string>& cells,
                                               const UnitFactors& factors) {
  std::vector<CsvField> headings;
  std::vector<std::string> names;
  bool measures = false;
  std::size_t own_names = 0;
  for (const std::string& cell : cells) {
    const auto exact = csv_column_named(cell, factors);
    const CsvField heading = parse_csv_heading(cell);
    const std::string quantity = csv_quantity_of(heading.label);
    std::string name = "-";
    if (exact && (exact->quantity == Quantity::kSync || exact->kind != CsvColumn::Kind::kValue ||
                  !is_named(exact->channel))) {
      name = cell;
    } else if (quantity != "-" && quantity != "seq") {
      name = csv_column_of(heading);
    } else if (quantity == "seq" && heading.unit.empty()) {
      name = "seq";
    } else if (!heading.label.empty()) {
      name = csv_own_name_of(heading, factors);
      if (name != "-") ++own_names;
    }
    const auto column = csv_column_named(name, factors);
    // A force in volts is known as one before its factor is.
    const bool lacks_factor = !column && is_electrical_press(name);
    measures = measures || lacks_factor ||
               (column && column->kind == CsvColumn::Kind::kValue && !is_named(column->channel));
    names.push_back(column || lacks_factor ? name : "-");
    headings.push_back(heading);
  }
  // A unit alone does not make a heading: "calibrated (g)" may be any line of text.
  if (!measures && (own_names < 2 || 2 * own_names < names.size())) return {};
  tell_csv_columns_apart(names, headings, factors);
  return names;
}

std::vector<std::string> csv_columns_of_labels(const std::vector<std::string>& names,
                                               const std::vector<std::string>& units,
                                               const UnitFactors& factors) {
  std::vector<std::string> columns;
  std::vector<CsvField> fields;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool stated = i < units.size() && !units[i].empty();
    CsvField field = stated ? CsvField{.label = names[i], .number = {}, .unit = units[i]}
                            : parse_csv_heading(names[i]);
    const auto exact = csv_column_named(names[i], factors);
    std::string column = !stated && exact ? names[i] : csv_column_of(field);
    // Not a unit: a name such as sensor_a.
    if (column == "-" && !stated)
      column = csv_column_of({.label = names[i], .number = {}, .unit = {}});
    columns.push_back(column.empty() ? "-" : std::move(column));
    fields.push_back(field);
  }
  tell_csv_columns_apart(columns, fields, factors);
  return columns;
}

std::string repeated_column(const std::vector<CsvColumn>& columns, const CsvColumn& further) {
  const auto other = std::ranges::find_if(
      columns, [&](const CsvColumn& column) { return same_quantity(column, further); });
  if (other == columns.end()) return {};
  if (other->name == further.name) {
    return "the column " + further.name +
           " is named twice: name each differently, such as thumb_N and index_N";
  }
  return "the columns " + other->name + " and " + further.name + " are both the " +
         further.name.substr(0, further.name.rfind('_')) + ": name one, and the other -";
}

Expected<std::vector<CsvColumn>, std::string> csv_columns_named(std::string_view names,
                                                                char separator,
                                                                const UnitFactors& factors) {
  std::vector<CsvColumn> columns;
  bool measures = false;
  std::vector<std::string> all;
  for (std::string_view rest = names; !rest.empty();) {
    if (!add_names(take_csv_part(rest, separator), all)) {
      return Unexpected<std::string>(
          "a name with * stands for several columns, as in taxel_kPa*256: write a number from 1 to "
          "1024 after it");
    }
  }
  for (const std::string& text : all) {
    const NamedCell cell(text);
    auto column = csv_column_named(cell.name, factors);
    if (!column) return Unexpected<std::string>(column.error());
    column->key = cell.key;
    if (std::string why = repeated_column(columns, *column); !why.empty()) {
      return Unexpected<std::string>(std::move(why));
    }
    measures = measures ||
               (column->kind == CsvColumn::Kind::kValue && column->quantity != Quantity::kSync);
    columns.push_back(std::move(*column));
  }
  if (!measures) {
    return Unexpected<std::string>(
        "no column is a force, a depth or a position: add one, for example force_N");
  }
  number_named_channels(columns);
  return columns;
}

bool read_csv_column(const CsvColumn& column, std::string_view part, CsvNumbers numbers,
                     DeviceReading& reading, std::optional<std::uint32_t>& number) {
  const bool decimal_comma = numbers == CsvNumbers::kDecimalComma;
  const bool plain = numbers == CsvNumbers::kPlain;
  switch (column.kind) {
    case CsvColumn::Kind::kSkip:
      return true;
    case CsvColumn::Kind::kTime: {
      if (!decimal_comma) {
        if (const auto time = parse_time(part, column.nanoseconds)) {
          reading.set_time(static_cast<double>(time->count()));
          if (!reading.wrong_time) reading.device_time = *time;  // exact
          return true;
        }
      }
      const CsvField field = parse_csv_field(part, decimal_comma);
      const auto count = plain ? parse_number(part) : field.number;
      // A unit may follow the number, but not another number.
      const bool endless = is_endless_number(part);
      if (!endless &&
          (!count || field.unit.find_first_of("0123456789,;") != std::string_view::npos)) {
        return false;
      }
      const double time_ns =
          (endless ? kInfinite : *count) * static_cast<double>(column.nanoseconds);
      reading.set_time(time_ns);
      return true;
    }
    case CsvColumn::Kind::kSequence: {
      const auto count = parse_number(part);
      if (!count || !(*count >= 0.0 && *count <= 4294967295.0) || *count != std::floor(*count)) {
        return false;
      }
      number = static_cast<std::uint32_t>(*count);
      return true;
    }
    case CsvColumn::Kind::kValue: {
      // Exact for a number without a unit, the usual case.
      if (const auto value = decimal_comma ? std::nullopt : parse_number(part, column.power)) {
        reading.set(column.channel, *value * column.rest);
        return true;
      }
      const CsvField field = parse_csv_field(part, decimal_comma);
      if (plain || !field.number) {
        // One sensor of several without a value is no damage to the others.
        const bool absent = plain || part.find_first_of("0123456789") == std::string_view::npos;
        if (!is_named(column.channel) || !absent) return false;
        reading.set(column.channel, std::numeric_limits<double>::quiet_NaN());
        return true;
      }
      double factor = column.factor;
      if (!field.unit.empty()) {
        const auto stated = stated_factor(column, field.unit);
        if (!stated) return false;
        factor = *stated;
      }
      reading.set(column.channel, *field.number * factor);
      return true;
    }
  }
  return false;
}

}  // namespace merkel
