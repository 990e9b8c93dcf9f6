// Frames of HBF1 with right checksums and arbitrary bodies, which random bytes do not reach. An
// input is, for each frame, its type, the length of its body, and the body. Built and run by
// fuzz.sh with libFuzzer.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "drivers/protocols/hbf1_frame.hpp"
#include "drivers/protocols/protocol_makers.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  std::span<const std::uint8_t> rest(data, size);
  const auto uri = Uri::parse("serial:x");
  UriOptions options(*uri);
  const auto protocol = make_hbf1(options);
  DeviceStream stream;
  std::chrono::nanoseconds now{std::chrono::seconds{1}};
  (*protocol)->begin(now, stream);
  (*protocol)->start(now, stream);
  std::uint16_t sequence = 0;
  while (rest.size() >= 2) {
    const auto type = static_cast<Hbf1Type>(rest[0] % 6U);
    const std::size_t length = std::min({std::size_t{rest[1]}, rest.size() - 2, kHbf1LongestBody});
    Bytes wire;
    append_hbf1_frame({.type = type, .sequence = sequence++, .time_us = 1000U * sequence},
                      rest.subspan(2, length), wire);
    rest = rest.subspan(2 + length);
    now += std::chrono::milliseconds{1};
    (*protocol)->take(wire, now, stream);
    for (const ChannelName& channel : (*protocol)->channel_names()) {
      if (channel.name.empty() || channel.column == 0) std::abort();
    }
  }
  for (const DeviceReading& reading : stream.readings) {
    if (!plausible(reading)) std::abort();
  }
  return 0;
}
