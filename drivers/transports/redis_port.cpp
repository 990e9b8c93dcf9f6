// Compiled only if hiredis is found.
#include "drivers/transports/redis_port.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "core/parameters/nearest_name.hpp"
#include "core/parameters/parameter_error.hpp"
#include "drivers/transports/redis_connection.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr std::chrono::milliseconds kRedisPatience{2000};
constexpr std::chrono::milliseconds kMaxBlock{500};  ///< below the timeout of replies
constexpr std::chrono::milliseconds kCountEvery{100};

struct IdentifiedEntry {
  std::string id;
  RedisEntry fields;
};

std::string redis_text(const redisReply* reply) {
  return reply != nullptr && reply->str != nullptr ? std::string(reply->str, reply->len) : "";
}

std::vector<IdentifiedEntry> redis_entries(const redisReply* list) {
  std::vector<IdentifiedEntry> entries;
  for (std::size_t i = 0; list != nullptr && i < list->elements; ++i) {
    const redisReply* const each = list->element[i];
    if (each->elements != 2) continue;
    IdentifiedEntry& entry = entries.emplace_back();
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
      : uri_(uri), stream_(std::move(stream)), lines_(std::move(fields)) {
    info_.name = "redis:" + uri_.path + " " + stream_;
    info_.note = "a Redis stream";
  }

  [[nodiscard]] std::string columns() const { return lines_.columns(); }

  [[nodiscard]] Expected<std::size_t, Disconnected> read(std::span<std::uint8_t> bytes,
                                                         nanoseconds patience) override {
    if (lines_.lines().empty()) {
      const auto entries = next_entries(patience);
      if (!entries) return Unexpected<Disconnected>(Disconnected{});
      for (const IdentifiedEntry& entry : *entries) lines_.add(entry.fields);
    }
    return lines_.lines().take(bytes);
  }

  /// Entries are only read.
  [[nodiscard]] Expected<void, Disconnected> write(
      std::span<const std::uint8_t> /*bytes*/) override {
    if (!connection_) return Unexpected<Disconnected>(Disconnected{});
    return {};
  }

  [[nodiscard]] Expected<void, SetupError> reopen() override {
    connection_.reset();
    lines_.reset();
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
    count_lost();  // those that came during an outage
    return {};
  }

  /// Waits for the first entry, and chooses the fields.
  Expected<void, SetupError> begin(const UnitFactors& factors) {
    if (auto opened = reopen(); !opened) return opened;
    for (auto left = kRedisPatience; left.count() > 0; left -= kMaxBlock) {
      const auto entries = next_entries(kMaxBlock);
      if (!entries || entries->empty()) continue;
      lines_.choose_fields(entries->front().fields, factors);
      for (const IdentifiedEntry& entry : *entries) lines_.add(entry.fields);
      if (!lines_.fields().empty()) return {};
      const std::string names =
          listed(entries->front().fields, [](const auto& field) { return field.first; });
      return bad_input("\"" + uri_.text +
                       "\": no field of its entries is a number and named as a " +
                       "force, a depth or a position (they are " + names +
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
  std::optional<std::vector<IdentifiedEntry>> next_entries(nanoseconds patience) {
    if (!connection_) return std::nullopt;
    std::vector<std::string> words = {"XREAD", "COUNT", "100"};
    const auto wait = std::min<nanoseconds>(patience, kMaxBlock) / std::chrono::milliseconds{1};
    // BLOCK 0 would wait for ever.
    if (wait > 0) words.insert(words.end(), {"BLOCK", std::to_string(wait)});
    words.insert(words.end(), {"STREAMS", stream_, last_id_});
    const RedisReply reply = command(words);
    if (!reply || reply->type == REDIS_REPLY_ERROR) {
      connection_.reset();
      return std::nullopt;
    }
    std::vector<IdentifiedEntry> entries;
    if (reply->elements == 1 && reply->element[0]->elements == 2) {
      entries = redis_entries(reply->element[0]->element[1]);
    }
    if (entries.empty()) return entries;
    last_id_ = entries.back().id;
    if (seen_) *seen_ += static_cast<std::int64_t>(entries.size());
    if (std::chrono::steady_clock::now() - counted_ > kCountEvery) count_lost();
    return entries;
  }

  /// Skips the entries that the stream has dropped before they were read. A server since Redis 7
  /// counts what came; that is the number of those read when the newest has been read.
  void count_lost() {
    counted_ = std::chrono::steady_clock::now();
    const RedisReply reply = command({"XINFO", "STREAM", stream_});
    std::optional<std::int64_t> added;
    bool newest_is_read = false;
    for (std::size_t i = 0; reply && i + 1 < reply->elements; i += 2) {
      const std::string name = redis_text(reply->element[i]);
      const redisReply* const value = reply->element[i + 1];
      if (name == "entries-added") added = value->integer;
      if (name == "last-generated-id") newest_is_read = redis_text(value) == last_id_;
    }
    if (!added || !newest_is_read) return;
    if (seen_ && *added > *seen_) lines_.skip(*added - *seen_);
    seen_ = added;
  }

  Uri uri_;
  std::string stream_;
  RedisConnection connection_;
  std::string last_id_;
  std::optional<std::int64_t> seen_;  ///< entries of the stream up to the last one read
  std::chrono::steady_clock::time_point counted_;
  RedisLines lines_;
};

}  // namespace

Expected<RedisEntries, SetupError> open_redis_stream(const Uri& uri, const std::string& stream,
                                                     std::vector<RedisField> fields,
                                                     const UnitFactors& factors) {
  auto port = std::make_unique<RedisPort>(uri, stream, std::move(fields));
  if (auto begun = port->begin(factors); !begun) return Unexpected<SetupError>(begun.error());
  RedisEntries entries{.port = nullptr, .columns = port->columns()};
  entries.port = std::move(port);
  return entries;
}

}  // namespace merkel
