#include "drivers/protocols/csv_columns.hpp"

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

}  // namespace

Expected<CsvColumn, std::string> csv_column_named(std::string_view name) {
  if (name == "-") return CsvColumn{};
  if (name == "seq") return CsvColumn{.kind = CsvColumn::Kind::kSequence};
  const auto mark = name.rfind('_');
  const std::string_view stem = name.substr(0, mark);
  const std::string_view unit = mark == std::string_view::npos ? "" : name.substr(mark + 1);
  if (stem == "time") {
    for (const auto& [known, ns] : {std::pair<std::string_view, std::int64_t>{"s", 1'000'000'000},
                                    {"ms", 1'000'000},
                                    {"us", 1'000}}) {
      if (unit == known) return CsvColumn{.kind = CsvColumn::Kind::kTime, .nanoseconds = ns};
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
    return CsvColumn{.kind = CsvColumn::Kind::kValue, .channel = channel, .factor = *factor};
  }
  return Unexpected<std::string>("the column " + std::string(name) +
                                 " is unknown; the known ones are " + csv_column_names());
}

std::string csv_column_names() {
  return "time_s, time_ms, time_us, seq, force_N, force_x_N, force_y_N, force_z_N, depth_mm, x_mm, "
         "y_mm, z_mm, and - to ignore a column; forces are in " +
         std::string(kForceUnits) + ", lengths in " + std::string(kLengthUnits);
}

std::vector<std::string> csv_columns_of_header(std::string_view line, char separator) {
  std::vector<std::string> names;
  bool measures = false;
  for (std::string_view rest = line; !rest.empty();) {
    const std::string_view cell = take_csv_part(rest, separator);
    const bool exact = csv_column_named(cell).has_value();
    const CsvField heading = parse_csv_heading(cell);
    // A unit alone does not make a heading: "calibrated (g)" may be any line of text.
    const std::string name = exact                                   ? std::string(cell)
                             : csv_quantity_of(heading.label) == "-" ? "-"
                                                                     : csv_column_of(heading);
    const auto column = csv_column_named(name);
    measures = measures || (column && column->kind == CsvColumn::Kind::kValue);
    names.push_back(column ? name : "-");
  }
  return measures ? names : std::vector<std::string>{};
}

Expected<std::vector<CsvColumn>, std::string> csv_columns_named(std::string_view names,
                                                                char separator) {
  std::vector<CsvColumn> columns;
  std::uint32_t channels = 0;
  std::string_view rest = names;
  while (!rest.empty()) {
    auto column = csv_column_named(take_csv_part(rest, separator));
    if (!column) return Unexpected<std::string>(column.error());
    if (column->kind == CsvColumn::Kind::kValue) channels |= bit_of(column->channel);
    columns.push_back(*column);
  }
  if (channels == 0U) {
    return Unexpected<std::string>(
        "no column is a force, a depth or a position: add one, for example force_N");
  }
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
      if (!field.number) return false;
      double factor = column.factor;
      if (!field.unit.empty()) {
        const bool force = column.channel <= DeviceChannel::kForceZ;
        const auto stated = force ? newtons_per(field.unit) : millimetres_per(field.unit);
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
