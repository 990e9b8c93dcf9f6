// Arbitrary bytes through one protocol of the table, MERKEL_FUZZED_PROTOCOL, with its usual options
// or MERKEL_FUZZED_OPTIONS. The first byte of an input determines how the rest is split. Built and
// run by fuzz.sh with libFuzzer.

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "drivers/protocols/protocol_table.hpp"

#ifndef MERKEL_FUZZED_OPTIONS
#define MERKEL_FUZZED_OPTIONS (*entry)->options
#endif

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  const auto entry = find_protocol(MERKEL_FUZZED_PROTOCOL);
  const auto uri = Uri::parse("serial:x?" + std::string(MERKEL_FUZZED_OPTIONS));
  UriOptions options(*uri);
  const auto protocol = (*entry)->make(options);
  if (!protocol || size == 0) return 0;
  const auto device = (*entry)->simulate(~0U);

  DeviceStream stream;
  std::chrono::nanoseconds now{std::chrono::seconds{1}};
  (*protocol)->begin(now, stream);
  (*protocol)->start(now, stream);
  Bytes reply;
  const std::size_t portion = 1 + data[0];
  for (std::size_t at = 1; at < size; at += portion) {
    const std::span<const std::uint8_t> bytes(data + at, std::min(portion, size - at));
    now += std::chrono::milliseconds{portion};
    static_cast<void>((*protocol)->poll(now, stream));
    (*protocol)->take(bytes, now, stream);
    device->take(bytes, now, reply);
    device->take(stream.outgoing, now, reply);
    stream.outgoing.clear();
    reply.clear();
  }
  for (const DeviceReading& reading : stream.readings) {
    if (!plausible(reading)) std::abort();
  }
  if (stream.counts.readings != stream.readings.size()) std::abort();
  return 0;
}
