#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"
#include "drivers/protocols/unit_factors.hpp"
#include "drivers/transports/line_buffer.hpp"

namespace merkel {

/// A field of the entries of a Redis stream. Its value is a number as text, or the bytes of one
/// number or of several (little-endian).
struct RedisField {
  enum class Type : std::uint8_t { kAny, kFloat64, kFloat32, kInt64, kInt32, kInt16 };
  std::string name;
  std::string column;  ///< of the protocol csv: "force_N"
  Type type = Type::kAny;
};

/// "FIELD:COLUMN:TYPE,…"; without a column the field's name is one, without a type a value is text,
/// or float64.
[[nodiscard]] Expected<std::vector<RedisField>, std::string> parse_redis_fields(
    std::string_view text);

/// An entry of a Redis stream: its fields, with arbitrary bytes.
using RedisEntry = std::map<std::string, std::string>;

/// The lines of a stream's entries for the protocol csv: `time_s`, `seq` unless a field is that
/// column, then the fields. An entry with several numbers in a field is as many lines. The times
/// are those of the field `time_ns`, or else of BRAND's `ts`, in ns (uint64 or int64); an entry
/// with several numbers and one time is spread evenly since the entry before.
class RedisLines {
 public:
  explicit RedisLines(std::vector<RedisField> fields)
      : fields_(std::move(fields)),
        numbered_(std::ranges::none_of(
            fields_, [](const RedisField& field) { return field.column == "seq"; })) {}

  [[nodiscard]] const std::vector<RedisField>& fields() const noexcept { return fields_; }
  /// The columns of the lines, as in the option `columns`.
  [[nodiscard]] std::string columns() const;
  [[nodiscard]] LineBuffer& lines() noexcept { return lines_; }
  /// If there are no fields yet: those of the entry whose names are columns of the protocol csv and
  /// whose values are numbers. \param factors  of those in volts or counts
  void choose_fields(const RedisEntry& entry, const UnitFactors& factors = {});
  /// Numbers that are missing are not a number.
  void add(const RedisEntry& entry);
  /// Entries are lost before the next one: its number follows theirs, as if they were like the last
  /// one.
  void skip(std::int64_t entries) noexcept {
    number_ += static_cast<std::uint32_t>(entries) * rows_of_last_;
  }
  /// The next entry is the first one of a connection.
  void reset() {
    lines_.clear();
    last_ns_.reset();
  }

 private:
  [[nodiscard]] std::vector<std::int64_t> times_of(const RedisEntry& entry, std::size_t rows);

  std::vector<RedisField> fields_;
  LineBuffer lines_;
  bool numbered_;
  std::uint32_t number_ = 0;  ///< of the next line
  std::uint32_t rows_of_last_ = 1;
  std::optional<std::int64_t> last_ns_;  ///< of the entry before
};

}  // namespace merkel
