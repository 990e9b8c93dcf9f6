#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/unit_factors.hpp"

namespace merkel {

/// The meaning of a column in the lines of a device.
struct CsvColumn {
  enum class Kind : std::uint8_t { kSkip, kTime, kSequence, kValue };
  Kind kind = Kind::kSkip;
  std::string name;      ///< with its unit
  std::string key = {};  ///< what the device calls it, if something else
  DeviceChannel channel = DeviceChannel::kForce;
  double factor = 1.0;  ///< to N or mm: 10^power · rest
  int power = 0;        ///< shifts the decimal point, which adds no rounding error
  double rest = 1.0;
  Quantity quantity = Quantity::kForce;  ///< of a value
  std::int64_t nanoseconds = 0;          ///< per unit of time

  void set_factor(double to_unit) noexcept;
};

/// How numbers are written.
enum class CsvNumbers : std::uint8_t {
  kPlain,         ///< nothing but the number, as in a trace
  kPoint,         ///< labels and units may stand beside it,
  kDecimalComma,  ///< also with a comma for the point
};

/// Parses the name of a column ("force_N"), or returns an error. A name of its own with a unit of
/// force or length ("thumb_N") is a named channel, here the first.
/// \param factors  of columns in volts or counts ("force_V"), which are refused without theirs
[[nodiscard]] Expected<CsvColumn, std::string> csv_column_named(std::string_view name,
                                                                const UnitFactors& factors = {});

/// True for a column of a force, depth or position in volts or counts, with or without its factor.
[[nodiscard]] bool is_electrical_press(std::string_view name);

/// The names of columns, separated by commas; "taxel_kPa*256" are 256 of them. Empty: wrong.
[[nodiscard]] std::vector<std::string> csv_names_of(std::string_view names);

/// The reverse: names separated by commas, in which "taxel_kPa*256" is short for taxel1_kPa to
/// taxel256_kPa.
[[nodiscard]] std::string csv_list_of(const std::vector<std::string>& names);

/// The channels that columns are.
[[nodiscard]] std::vector<ChannelName> names_of_columns(const std::vector<CsvColumn>& columns);

/// Parses the names of all columns; "t:time_s" is the column time_s, which the device calls t.
/// Fails if none is a force, a length or a pressure, or if two are the same.
[[nodiscard]] Expected<std::vector<CsvColumn>, std::string> csv_columns_named(
    std::string_view names, char separator, const UnitFactors& factors = {});

/// Why a further column cannot be read beside others; empty: it can.
[[nodiscard]] std::string repeated_column(const std::vector<CsvColumn>& columns,
                                          const CsvColumn& further);

/// The cells of a line.
[[nodiscard]] std::vector<std::string> csv_cells_of(std::string_view line, char separator);

/// The columns that the cells of a header name, with their units: "force_g,depth_mm", "Force (g);
/// Depth (mm)", "thumb_N,index_N". A cell with another meaning is "-". Empty unless a force, depth
/// or position has its unit, or two other names have one.
[[nodiscard]] std::vector<std::string> csv_columns_of_header(const std::vector<std::string>& cells,
                                                             const UnitFactors& factors = {});

/// The columns that the names in rows mean: as in a header, but a single one is enough, and a
/// name whose unit stands with its number is taken for the quantity that it means.
/// \param units  of each, as they stand with its number; may be empty
[[nodiscard]] std::vector<std::string> csv_columns_of_labels(const std::vector<std::string>& names,
                                                             const std::vector<std::string>& units,
                                                             const UnitFactors& factors = {});

/// True if two columns are the same whatever their unit: thumb_N and thumb_g.
[[nodiscard]] bool same_quantity(const CsvColumn& a, const CsvColumn& b);

/// The names and units of columns, for messages.
[[nodiscard]] std::string csv_column_names();

/// True for a sync line: "sync", "sync1", "sync2", …
[[nodiscard]] bool is_sync_name(std::string_view name) noexcept;

/// Reads the field of a column into a reading, a sequence number into `number`: the only parser of
/// rows, those of devices and of traces. False if the field does not hold what the column requires.
[[nodiscard]] bool read_csv_column(const CsvColumn& column, std::string_view field,
                                   CsvNumbers numbers, DeviceReading& reading,
                                   std::optional<std::uint32_t>& number);

}  // namespace merkel
