#include "drivers/transports/redis_lines.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <span>
#include <utility>

#include "drivers/files/csv_text.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/take_part.hpp"

namespace merkel {
namespace {

using FieldType = RedisField::Type;

constexpr std::size_t kMaxNumbers = 4096;                         ///< of a field of an entry
constexpr std::int64_t kFarthest_ns = 4'000'000'000'000'000'000;  ///< as parse_seconds()
constexpr std::pair<std::string_view, FieldType> kRedisTypes[] = {{"float64", FieldType::kFloat64},
                                                                  {"float32", FieldType::kFloat32},
                                                                  {"int64", FieldType::kInt64},
                                                                  {"int32", FieldType::kInt32},
                                                                  {"int16", FieldType::kInt16}};

template <class Number, class Value>
bool add_numbers(std::string_view bytes, std::vector<Value>& values) {
  if (bytes.empty() || bytes.size() % sizeof(Number) != 0 ||
      bytes.size() / sizeof(Number) > kMaxNumbers) {
    return false;
  }
  for (; !bytes.empty(); bytes.remove_prefix(sizeof(Number))) {
    Number number{};
    std::memcpy(&number, bytes.data(), sizeof number);
    values.push_back(static_cast<Value>(number));
  }
  return true;
}

/// Whether bytes can be measured values, missing ones included. BRAND's label `sync`, a JSON
/// object, cannot: its last number ends with the byte of "}", so it is above 1e280.
bool can_be_measured(std::span<const double> values) {
  return std::none_of(values.begin(), values.end(),
                      [](double value) { return std::isfinite(value) && std::abs(value) > 1e100; });
}

/// The numbers of a field. Empty if it holds something else.
std::vector<double> redis_numbers(std::string_view text, FieldType type) {
  std::vector<double> values;
  bool good = false;
  switch (type) {
    case FieldType::kAny:
      if (const auto number = parse_number(text)) return {*number};
      good = add_numbers<double>(text, values) && can_be_measured(values);
      break;
    case FieldType::kFloat64:
      good = add_numbers<double>(text, values);
      break;
    case FieldType::kFloat32:
      good = add_numbers<float>(text, values);
      break;
    case FieldType::kInt64:
      good = add_numbers<std::int64_t>(text, values);
      break;
    case FieldType::kInt32:
      good = add_numbers<std::int32_t>(text, values);
      break;
    case FieldType::kInt16:
      good = add_numbers<std::int16_t>(text, values);
      break;
  }
  return good ? values : std::vector<double>();
}

bool is_redis_time(std::int64_t time_ns) {
  return time_ns >= -kFarthest_ns && time_ns <= kFarthest_ns;
}

/// Times in ns: 8 bytes each, or text. Empty if they are something else, or out of range.
std::vector<std::int64_t> redis_times(std::string_view text) {
  std::vector<std::int64_t> times;
  if (const auto time = parse_time(text, 1)) return {time->count()};
  if (!add_numbers<std::int64_t>(text, times) ||
      !std::all_of(times.begin(), times.end(), is_redis_time)) {
    times.clear();
  }
  return times;
}

}  // namespace

void RedisLines::choose_fields(const RedisEntry& entry, const UnitFactors& factors) {
  if (!fields_.empty()) return;
  for (const auto& [name, value] : entry) {
    const auto column = csv_column_named(name, factors);
    if (column && column->kind == CsvColumn::Kind::kValue &&
        !redis_numbers(value, FieldType::kAny).empty()) {
      fields_.push_back({.name = name, .column = name});
    }
  }
}

std::string RedisLines::columns() const {
  std::string columns = numbered_ ? "time_s,seq" : "time_s";
  for (const RedisField& field : fields_) columns += "," + field.column;
  return columns;
}

void RedisLines::add(const RedisEntry& entry) {
  std::vector<std::vector<double>> values;
  std::size_t rows = 0;
  for (const RedisField& field : fields_) {
    const auto found = entry.find(field.name);
    values.push_back(found == entry.end() ? std::vector<double>()
                                          : redis_numbers(found->second, field.type));
    rows = std::max(rows, values.back().size());
  }
  const std::vector<std::int64_t> times = times_of(entry, rows);
  if (rows > 0) rows_of_last_ = static_cast<std::uint32_t>(rows);
  std::vector<double> line;
  for (std::size_t row = 0; row < rows; ++row) {
    line.clear();
    if (numbered_) line.push_back(number_++);
    for (const std::vector<double>& each : values) {
      line.push_back(row < each.size() ? each[row] : std::numeric_limits<double>::quiet_NaN());
    }
    std::string time_s = "nan";
    if (row < times.size()) {
      time_s.clear();
      append_seconds(time_s, std::chrono::nanoseconds{times[row]});
    }
    lines_.add(time_s, line);
  }
}

std::vector<std::int64_t> RedisLines::times_of(const RedisEntry& entry, std::size_t rows) {
  std::vector<std::int64_t> times;
  for (const char* const name : {"time_ns", "ts"}) {
    const auto found = entry.find(name);
    if (times.empty() && found != entry.end()) times = redis_times(found->second);
  }
  if (times.empty() || rows == 0) return {};
  const std::int64_t newest = times.back();
  if (times.size() != rows) {
    const std::int64_t step =
        last_ns_ && newest > *last_ns_ ? (newest - *last_ns_) / static_cast<std::int64_t>(rows) : 0;
    times.clear();
    for (std::size_t i = rows; i-- > 0;) {
      times.push_back(newest - step * static_cast<std::int64_t>(i));
    }
  }
  last_ns_ = newest;
  return times;
}

Expected<std::vector<RedisField>, std::string> parse_redis_fields(std::string_view text) {
  std::vector<RedisField> fields;
  while (!text.empty()) {
    std::string_view rest = take_field(text);
    std::array<std::string, 3> parts;
    for (std::string& part : parts) part = take_part(rest, ':');
    RedisField field{.name = parts[0], .column = parts[1].empty() ? parts[0] : parts[1]};
    const auto known = std::find_if(std::begin(kRedisTypes), std::end(kRedisTypes),
                                    [&](const auto& each) { return each.first == parts[2]; });
    if (field.name.empty() || !rest.empty() ||
        (known == std::end(kRedisTypes) && !parts[2].empty())) {
      return Unexpected<std::string>(
          "the option fields is a list of FIELD:COLUMN:TYPE, for example "
          "fields=samples:force_N:int16; the types are float64, float32, int64, int32 and int16");
    }
    if (known != std::end(kRedisTypes)) field.type = known->second;
    fields.push_back(std::move(field));
  }
  return fields;
}

}  // namespace merkel
