// Compiled only if hiredis is found.
#include "drivers/transports/redis_port.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <map>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/redis_connection.hpp"

namespace merkel {
namespace {

using FieldType = RedisField::Type;
using std::chrono::nanoseconds;

constexpr std::chrono::milliseconds kRedisPatience{2000};
constexpr std::chrono::milliseconds kLongestBlock{500};  ///< below the timeout of replies
constexpr std::size_t kMostNumbers = 4096;               ///< of a field of an entry
constexpr std::pair<std::string_view, FieldType> kRedisTypes[] = {{"float64", FieldType::kFloat64},
                                                                  {"float32", FieldType::kFloat32},
                                                                  {"int64", FieldType::kInt64},
                                                                  {"int32", FieldType::kInt32},
                                                                  {"int16", FieldType::kInt16}};

template <class Number, class Value>
bool add_numbers(std::string_view bytes, std::vector<Value>& values) {
  if (bytes.empty() || bytes.size() % sizeof(Number) != 0 ||
      bytes.size() / sizeof(Number) > kMostNumbers) {
    return false;
  }
  for (; !bytes.empty(); bytes.remove_prefix(sizeof(Number))) {
    Number number{};
    std::memcpy(&number, bytes.data(), sizeof number);
    values.push_back(static_cast<Value>(number));
  }
  return true;
}

/// The numbers of a field. Empty if it holds something else.
std::vector<double> redis_numbers(std::string_view text, FieldType type) {
  std::vector<double> values;
  bool good = false;
  switch (type) {
    case FieldType::kAny:
      if (const auto number = parse_number(text)) return {*number};
      [[fallthrough]];
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

/// Times in ns: 8 bytes each, or text.
std::vector<std::int64_t> redis_times(std::string_view text) {
  std::vector<std::int64_t> times;
  constexpr double kLargest_ns = 9e18;
  const auto number = parse_number(text);
  if (number && std::abs(*number) < kLargest_ns) return {static_cast<std::int64_t>(*number)};
  if (!add_numbers<std::int64_t>(text, times)) times.clear();
  return times;
}

std::string seconds_of(std::int64_t time_ns) {
  std::string text;
  append_seconds(text, nanoseconds{time_ns});
  return text;
}

/// An entry: its identifier and fields.
struct RedisEntry {
  std::string id;
  std::map<std::string, std::string> fields;
};

std::string redis_text(const redisReply* reply) {
  return reply != nullptr && reply->str != nullptr ? std::string(reply->str, reply->len) : "";
}

std::vector<RedisEntry> redis_entries(const redisReply* list) {
  std::vector<RedisEntry> entries;
  for (std::size_t i = 0; list != nullptr && i < list->elements; ++i) {
    const redisReply* const each = list->element[i];
    if (each->elements != 2) continue;
    RedisEntry& entry = entries.emplace_back();
    entry.id = redis_text(each->element[0]);
    const redisReply* const fields = each->element[1];
    for (std::size_t k = 0; k + 1 < fields->elements; k += 2) {
      entry.fields[redis_text(fields->element[k])] = redis_text(fields->element[k + 1]);
    }
  }
  return entries;
}

class RedisPort final : public Transport {
 public:
  RedisPort(const Uri& uri, std::string stream, std::vector<RedisField> fields)
      : uri_(uri), stream_(std::move(stream)), fields_(std::move(fields)) {
    info_.name = "redis:" + uri_.path + " " + stream_;
    info_.note = "a Redis stream";
  }

  [[nodiscard]] const TransportInfo& info() const noexcept override { return info_; }
  [[nodiscard]] const std::vector<RedisField>& fields() const noexcept { return fields_; }

  [[nodiscard]] Expected<std::size_t, Disconnected> read(std::span<std::uint8_t> bytes,
                                                         nanoseconds patience) override {
    if (waiting_.empty()) {
      const auto entries = next_entries(patience);
      if (!entries) return Unexpected<Disconnected>(Disconnected{});
      for (const RedisEntry& entry : *entries) add_lines(entry);
    }
    const std::size_t count = std::min(bytes.size(), waiting_.size());
    std::copy_n(waiting_.begin(), count, bytes.begin());
    waiting_.erase(0, count);
    return count;
  }

  /// Entries are only read.
  [[nodiscard]] Expected<void, Disconnected> write(
      std::span<const std::uint8_t> /*bytes*/) override {
    if (!connection_) return Unexpected<Disconnected>(Disconnected{});
    return {};
  }

  [[nodiscard]] Expected<void, SetupError> reopen() override {
    connection_.reset();
    waiting_.clear();
    last_ns_.reset();
    auto connection = connect_to_redis(uri_, true);
    if (!connection) return Unexpected<SetupError>(connection.error());
    connection_ = std::move(*connection);
    const auto newest = command({"XREVRANGE", stream_, "+", "-", "COUNT", "1"});
    if (!newest || newest->type == REDIS_REPLY_ERROR) {
      return unavailable("\"" + uri_.text + "\": the Redis server refused: " +
                         (newest ? redis_text(newest.get()) : "no reply"));
    }
    const auto entries = redis_entries(newest.get());
    last_id_ = entries.empty() ? "0-0" : entries.front().id;
    return {};
  }

  /// Waits for the first entry, and chooses the fields.
  Expected<void, SetupError> begin() {
    if (auto opened = reopen(); !opened) return opened;
    for (auto left = kRedisPatience; left.count() > 0; left -= kLongestBlock) {
      const auto entries = next_entries(kLongestBlock);
      if (!entries || entries->empty()) continue;
      choose_fields(entries->front());
      for (const RedisEntry& entry : *entries) add_lines(entry);
      if (!fields_.empty()) return {};
      std::string names;
      for (const auto& [name, value] : entries->front().fields) {
        names.append(names.empty() ? "" : ", ").append(name);
      }
      return bad_input("\"" + uri_.text + "\": no field of its entries names a force, a depth or " +
                       "a position (they are " + names +
                       "): name one, for example fields=samples:force_N:int16");
    }
    return unavailable("\"" + uri_.text + "\": no entry came to the stream " + stream_ +
                       ": start its node, and check the stream's name");
  }

 private:
  RedisReply command(const std::vector<std::string>& words) {
    std::vector<const char*> texts;
    std::vector<std::size_t> sizes;
    for (const std::string& word : words) {
      texts.push_back(word.data());
      sizes.push_back(word.size());
    }
    return RedisReply(static_cast<redisReply*>(redisCommandArgv(
        connection_.get(), static_cast<int>(texts.size()), texts.data(), sizes.data())));
  }

  /// The entries after the last one; none on a timeout. Nothing if the server is gone.
  std::optional<std::vector<RedisEntry>> next_entries(nanoseconds patience) {
    if (!connection_) return std::nullopt;
    std::vector<std::string> words = {"XREAD", "COUNT", "100"};
    const auto wait = std::min<nanoseconds>(patience, kLongestBlock) / std::chrono::milliseconds{1};
    // BLOCK 0 would wait for ever.
    if (wait > 0) words.insert(words.end(), {"BLOCK", std::to_string(wait)});
    words.insert(words.end(), {"STREAMS", stream_, last_id_});
    const RedisReply reply = command(words);
    if (!reply || reply->type == REDIS_REPLY_ERROR) {
      connection_.reset();
      return std::nullopt;
    }
    std::vector<RedisEntry> entries;
    if (reply->elements == 1 && reply->element[0]->elements == 2) {
      entries = redis_entries(reply->element[0]->element[1]);
    }
    if (!entries.empty()) last_id_ = entries.back().id;
    return entries;
  }

  void choose_fields(const RedisEntry& entry) {
    if (!fields_.empty()) return;
    for (const auto& [name, value] : entry.fields) {
      const auto column = csv_column_named(name);
      if (column && column->kind == CsvColumn::Kind::kValue) {
        fields_.push_back({.name = name, .column = name});
      }
    }
  }

  /// A line for each number of the fields. Numbers that are missing are not a number.
  void add_lines(const RedisEntry& entry) {
    std::vector<std::vector<double>> values;
    std::size_t rows = 0;
    for (const RedisField& field : fields_) {
      const auto found = entry.fields.find(field.name);
      values.push_back(found == entry.fields.end() ? std::vector<double>()
                                                   : redis_numbers(found->second, field.type));
      rows = std::max(rows, values.back().size());
    }
    const std::vector<std::int64_t> times = times_of_rows(entry, rows);
    for (std::size_t row = 0; row < rows; ++row) {
      waiting_ += row < times.size() ? seconds_of(times[row]) : "nan";
      for (const auto& each : values) {
        waiting_ += row < each.size() ? "," + shortest_decimal(each[row]) : ",nan";
      }
      waiting_ += '\n';
    }
  }

  std::vector<std::int64_t> times_of_rows(const RedisEntry& entry, std::size_t rows) {
    std::vector<std::int64_t> times;
    for (const char* const name : {"time_ns", "ts"}) {
      const auto found = entry.fields.find(name);
      if (times.empty() && found != entry.fields.end()) times = redis_times(found->second);
    }
    if (times.empty() || rows == 0) return {};
    const std::int64_t newest = times.back();
    if (times.size() != rows) {
      const std::int64_t step = last_ns_ && newest > *last_ns_
                                    ? (newest - *last_ns_) / static_cast<std::int64_t>(rows)
                                    : 0;
      times.clear();
      for (std::size_t i = rows; i-- > 0;) {
        times.push_back(newest - step * static_cast<std::int64_t>(i));
      }
    }
    last_ns_ = newest;
    return times;
  }

  Uri uri_;
  std::string stream_;
  std::vector<RedisField> fields_;
  TransportInfo info_;
  RedisConnection connection_;
  std::string last_id_;
  std::optional<std::int64_t> last_ns_;  ///< of the entry before
  std::string waiting_;                  ///< lines that have not been read
};

}  // namespace

Expected<std::vector<RedisField>, std::string> parse_redis_fields(std::string_view text) {
  std::vector<RedisField> fields;
  while (!text.empty()) {
    std::string_view rest = take_field(text);
    std::array<std::string, 3> parts;
    for (std::string& part : parts) {
      const auto end = std::min(rest.find(':'), rest.size());
      part = rest.substr(0, end);
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
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

Expected<RedisEntries, SetupError> open_redis_stream(const Uri& uri, const std::string& stream,
                                                     std::vector<RedisField> fields) {
  auto port = std::make_unique<RedisPort>(uri, stream, std::move(fields));
  if (auto begun = port->begin(); !begun) return Unexpected<SetupError>(begun.error());
  RedisEntries entries{.port = nullptr, .fields = port->fields()};
  entries.port = std::move(port);
  return entries;
}

}  // namespace merkel
