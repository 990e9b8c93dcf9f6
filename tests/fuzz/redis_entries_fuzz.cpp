// Arbitrary entries of a Redis stream through the probe redis: and the protocol csv. The first line
// of an input is the option fields; then each entry is a count of fields, and for each the lengths
// of its name and its value, and both. Built and run by fuzz.sh with libFuzzer.

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "drivers/protocols/protocol_makers.hpp"
#include "drivers/transports/redis_lines.hpp"
#include "drivers/uri.hpp"

namespace {

std::size_t byte_of(std::string_view& rest) {
  if (rest.empty()) return 0;
  const auto value = static_cast<unsigned char>(rest.front());
  rest.remove_prefix(1);
  return value;
}

std::string text_of(std::string_view& rest, std::size_t length) {
  const std::string text(rest.substr(0, length));
  rest.remove_prefix(text.size());
  return text;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  const std::size_t line = std::min(rest.find('\n'), rest.size());
  auto fields = parse_redis_fields(rest.substr(0, line));
  if (!fields) return 0;
  rest.remove_prefix(std::min(line + 1, rest.size()));

  RedisLines lines(std::move(*fields));
  std::unique_ptr<Protocol> protocol;
  DeviceStream stream;
  std::chrono::nanoseconds now{std::chrono::seconds{1}};
  while (!rest.empty()) {
    RedisEntry entry;
    for (std::size_t left = byte_of(rest) % 8; left > 0 && !rest.empty(); --left) {
      const std::size_t name = byte_of(rest);
      const std::size_t value = byte_of(rest);
      const std::string key = text_of(rest, name);
      entry[key] = text_of(rest, value);
    }
    lines.choose_fields(entry);
    lines.add(entry);
    if (!protocol) {
      if (lines.fields().empty()) continue;
      Uri uri = *Uri::parse("redis:x");
      uri.options["columns"] = lines.columns();
      UriOptions options(uri);
      auto made = make_csv_lines(options);
      if (!made) return 0;
      protocol = std::move(*made);
      protocol->begin(now, stream);
      protocol->start(now, stream);
    }
    std::array<std::uint8_t, 100> bytes{};
    while (!lines.lines().empty()) {
      now += std::chrono::milliseconds{1};
      protocol->take(std::span(bytes).first(lines.lines().take(bytes)), now, stream);
    }
  }
  for (const DeviceReading& reading : stream.readings) {
    if (!plausible(reading)) std::abort();
  }
  return 0;
}
