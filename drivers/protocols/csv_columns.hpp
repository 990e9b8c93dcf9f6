#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"
#include "drivers/protocols/device_reading.hpp"

namespace merkel {

/// The meaning of a column in the lines of a device.
struct CsvColumn {
  enum class Kind : std::uint8_t { kSkip, kTime, kSequence, kValue };
  Kind kind = Kind::kSkip;
  std::string name;  ///< with its unit
  DeviceChannel channel = DeviceChannel::kForce;
  double factor = 1.0;           ///< to N or mm
  bool force = true;             ///< of a value: in N; else in mm, or
  bool pressure = false;         ///< in kPa
  std::int64_t nanoseconds = 0;  ///< per unit of time
};

/// Parses the name of a column ("force_N"), or returns an error. A name of its own with a unit of
/// force or length ("thumb_N") is a named channel, here the first.
[[nodiscard]] Expected<CsvColumn, std::string> csv_column_named(std::string_view name);

/// The names of columns, separated by commas; "taxel_kPa*256" are 256 of them. Empty: wrong.
[[nodiscard]] std::vector<std::string> csv_names_of(std::string_view names);

/// The reverse: names separated by commas, in which "taxel_kPa*256" is short for taxel1_kPa to
/// taxel256_kPa.
[[nodiscard]] std::string csv_list_of(const std::vector<std::string>& names);

/// Numbers the channels with names of their own in the order of their columns.
void number_named_channels(std::vector<CsvColumn>& columns) noexcept;

/// Parses the names of all columns. Fails if none is a force or a length, or if two are the same.
[[nodiscard]] Expected<std::vector<CsvColumn>, std::string> csv_columns_named(
    std::string_view names, char separator);

/// The columns that a header line names, with their units: "force_g,depth_mm", "Force (g); Depth
/// (mm)", "thumb_N,index_N". A cell with another meaning is ignored. Empty unless a force, depth or
/// position has its unit, or two other names have one.
[[nodiscard]] std::vector<std::string> csv_columns_of_header(std::string_view line, char separator);

/// The names and units of columns, for messages.
[[nodiscard]] std::string csv_column_names();

/// Reads the field of a column into a reading, a sequence number into `number`. False if the field
/// does not hold what the column requires.
[[nodiscard]] bool read_csv_column(const CsvColumn& column, std::string_view field,
                                   bool decimal_comma, DeviceReading& reading,
                                   std::optional<std::uint32_t>& number);

}  // namespace merkel
