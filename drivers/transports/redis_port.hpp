#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/transports/transport.hpp"
#include "drivers/uri.hpp"

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

/// The entries of a Redis stream as a port that sends lines: `time_s`, then the fields. The
/// protocol csv parses them. An entry with several numbers in a field is as many lines. The times
/// are those of the field `time_ns`, or else of BRAND's `ts`, in ns (uint64 or int64); an entry
/// with several numbers and one time is spread evenly since the entry before.
struct RedisEntries {
  std::unique_ptr<Transport> port;
  std::vector<RedisField> fields;
};

/// Opens the entries that come from now on; waits two seconds for the first.
/// \param fields  empty: those of the first entry whose names are columns of the protocol csv
[[nodiscard]] Expected<RedisEntries, SetupError> open_redis_stream(const Uri& uri,
                                                                   const std::string& stream,
                                                                   std::vector<RedisField> fields);

}  // namespace merkel
