#include "drivers/protocols/csv_columns.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "drivers/files/csv_text.hpp"
#include "drivers/protocols/csv_text_style.hpp"
#include "drivers/protocols/device_units.hpp"

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

constexpr int kMostRepeated = 1024;
constexpr std::size_t kWorthShortening = 8;  ///< names in a row

/// "taxel17_kPa" for "taxel_kPa" and 17.
std::string numbered_column(std::string_view name, std::size_t number) {
  const auto unit = std::min(name.rfind('_'), name.size());
  return std::string(name.substr(0, unit)) + std::to_string(number) +
         std::string(name.substr(unit));
}

/// Adds a name or, for "taxel_kPa*256", as many numbered ones. False if the number is wrong.
bool add_names(std::string_view text, std::vector<std::string>& names) {
  const auto star = text.rfind('*');
  if (star == std::string_view::npos) {
    names.emplace_back(text);
    return true;
  }
  const std::string_view name = text.substr(0, star);
  int count = 0;
  const auto [end, error] =
      std::from_chars(text.data() + star + 1, text.data() + text.size(), count);
  if (error != std::errc{} || end != text.data() + text.size() || count < 1 ||
      count > kMostRepeated) {
    return false;
  }
  for (int i = 1; i <= count; ++i)
    names.push_back(numbered_column(name, static_cast<std::size_t>(i)));
  return true;
}

}  // namespace

Expected<CsvColumn, std::string> csv_column_named(std::string_view name) {
  if (name == "-") return CsvColumn{};
  if (name == "seq") return CsvColumn{.kind = CsvColumn::Kind::kSequence, .name = "seq"};
  const auto mark = name.rfind('_');
  const std::string_view stem = name.substr(0, mark);
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
  for (std::size_t i = 0; i < kDeviceChannels; ++i) {
    if (stem != kDeviceChannelNames[i]) continue;
    const auto channel = static_cast<DeviceChannel>(i);
    const bool force = channel <= DeviceChannel::kForceZ;
    const auto factor = force ? newtons_per(unit) : millimetres_per(unit);
    if (!factor) {
      return Unexpected<std::string>("the unit of " + std::string(name) + " is unknown: " +
                                     (force ? "forces are in " + std::string(kForceUnits)
                                            : "lengths are in " + std::string(kLengthUnits)));
    }
    return CsvColumn{.kind = CsvColumn::Kind::kValue,
                     .name = std::string(name),
                     .channel = channel,
                     .factor = *factor,
                     .force = force};
  }
  const auto newtons = newtons_per(unit);
  const auto kilopascals = kilopascals_per(unit);
  const auto factor = newtons ? newtons : (kilopascals ? kilopascals : millimetres_per(unit));
  if (factor && !stem.empty()) {
    return CsvColumn{.kind = CsvColumn::Kind::kValue,
                     .name = std::string(name),
                     .channel = named_channel(0),
                     .factor = *factor,
                     .force = newtons.has_value(),
                     .pressure = kilopascals.has_value()};
  }
  return Unexpected<std::string>("the column " + std::string(name) +
                                 " is unknown; the known ones are " + csv_column_names());
}

std::string csv_column_names() {
  return "time_s, time_ms, time_us, seq, force_N, force_x_N, force_y_N, force_z_N, depth_mm, x_mm, "
         "y_mm, z_mm, names of your own with a unit, such as thumb_N, and - to ignore a column; "
         "forces are in " +
         std::string(kForceUnits) + ", lengths in " + std::string(kLengthUnits) +
         ", pressures in " + std::string(kPressureUnits) +
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
    const auto mark = std::min(names[i].rfind('_'), names[i].size());
    std::string stem = names[i];
    std::size_t count = 0;
    if (mark > 0 && names[i][mark - 1] == '1') {
      stem.erase(mark - 1, 1);
      const std::size_t most = std::min<std::size_t>(names.size() - i, kMostRepeated);
      while (count < most && names[i + count] == numbered_column(stem, count + 1)) ++count;
    }
    const bool shorten = count >= kWorthShortening;
    list += (i == 0 ? "" : ",") + (shorten ? stem + "*" + std::to_string(count) : names[i]);
    i += shorten ? count : 1;
  }
  return list;
}

void number_named_channels(std::vector<CsvColumn>& columns) noexcept {
  std::size_t next = 0;
  for (CsvColumn& column : columns) {
    if (column.kind == CsvColumn::Kind::kValue && is_named(column.channel)) {
      column.channel = named_channel(next++);
    }
  }
}

std::vector<std::string> csv_columns_of_header(std::string_view line, char separator) {
  std::vector<CsvField> headings;
  std::vector<std::string> names;
  bool measures = false;
  std::size_t own_names = 0;
  for (std::string_view rest = line; !rest.empty();) {
    const std::string_view cell = take_csv_part(rest, separator);
    const auto exact = csv_column_named(cell);
    const CsvField heading = parse_csv_heading(cell);
    const std::string quantity = csv_quantity_of(heading.label);
    std::string name = "-";
    if (exact && !(exact->kind == CsvColumn::Kind::kValue && is_named(exact->channel))) {
      name = cell;
    } else if (quantity != "-" && quantity != "seq") {
      name = csv_column_of(heading);
    } else if (quantity == "seq" && heading.unit.empty()) {
      name = "seq";
    } else if (!heading.label.empty()) {
      name = csv_own_name_of(heading);
      if (name != "-") ++own_names;
    }
    const auto column = csv_column_named(name);
    measures = measures ||
               (column && column->kind == CsvColumn::Kind::kValue && !is_named(column->channel));
    names.push_back(column ? name : "-");
    headings.push_back(heading);
  }
  // A unit alone does not make a heading: "calibrated (g)" may be any line of text.
  if (!measures && (own_names < 2 || 2 * own_names < names.size())) return {};
  tell_csv_columns_apart(names, headings);
  return names;
}

Expected<std::vector<CsvColumn>, std::string> csv_columns_named(std::string_view names,
                                                                char separator) {
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
  for (const std::string& name : all) {
    auto column = csv_column_named(name);
    if (!column) return Unexpected<std::string>(column.error());
    for (const CsvColumn& other : columns) {
      if (other.name != column->name || column->kind == CsvColumn::Kind::kSkip) continue;
      return Unexpected<std::string>("the column " + column->name +
                                     " is named twice: name each differently, such as thumb_N and "
                                     "index_N");
    }
    measures = measures || column->kind == CsvColumn::Kind::kValue;
    columns.push_back(std::move(*column));
  }
  if (!measures) {
    return Unexpected<std::string>(
        "no column is a force, a depth or a position: add one, for example force_N");
  }
  number_named_channels(columns);
  return columns;
}

bool read_csv_column(const CsvColumn& column, std::string_view part, bool decimal_comma,
                     DeviceReading& reading, std::optional<std::uint32_t>& number) {
  switch (column.kind) {
    case CsvColumn::Kind::kSkip:
      return true;
    case CsvColumn::Kind::kTime: {
      if (column.nanoseconds == 1'000'000'000 && !decimal_comma) {
        if (const auto time = parse_seconds(part)) {
          reading.set_time(static_cast<double>(time->count()));
          if (!reading.wrong_time) reading.device_time = *time;  // exact
          return true;
        }
      }
      const CsvField field = parse_csv_field(part, decimal_comma);
      const auto& count = field.number;
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
      if (const auto value = decimal_comma ? std::nullopt : parse_number(part)) {
        reading.set(column.channel, *value * column.factor);
        return true;
      }
      const CsvField field = parse_csv_field(part, decimal_comma);
      if (!field.number) {
        // One sensor of several without a value is no damage to the others.
        const bool absent = part.find_first_of("0123456789") == std::string_view::npos;
        if (!is_named(column.channel) || !absent) return false;
        reading.set(column.channel, std::numeric_limits<double>::quiet_NaN());
        return true;
      }
      double factor = column.factor;
      if (!field.unit.empty()) {
        const auto stated = column.force      ? newtons_per(field.unit)
                            : column.pressure ? kilopascals_per(field.unit)
                                              : millimetres_per(field.unit);
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
