// Arbitrary bytes as the scans of a data-acquisition card. The first byte of an input chooses the
// width of a sample, the number of channels and how the rest is split; a byte 0x7F at the begin of
// a portion starts the scans anew. Built and run by fuzz.sh with libFuzzer.

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <utility>

#include "drivers/protocols/analog_scans.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  if (size == 0) return 0;
  AnalogFormat format{.columns = {},
                      .conversions = {},
                      .sample_bytes = (data[0] & 1U) != 0U ? 4U : 2U,
                      .period = std::chrono::microseconds{100}};
  const std::size_t channels = 1 + (data[0] >> 1U) % 4;
  std::string names = "force_N";
  for (std::size_t i = 0; i < channels; ++i) {
    if (i > 0) names += ",a" + std::to_string(i) + "_mm";
    format.conversions.push_back({.coefficients = {-10.0, 20.0 / 65535.0}, .largest = 65535});
  }
  format.columns = *csv_columns_named(names, ',');
  const std::size_t scan = channels * format.sample_bytes;
  const auto protocol = make_analog_scans(std::move(format));
  DeviceStream stream;
  protocol->begin({}, stream);
  const std::size_t portion = 1 + (data[0] >> 3U);
  std::size_t whole = 0;
  std::size_t since_begin = 0;
  for (std::size_t at = 1; at < size; at += portion) {
    const std::span<const std::uint8_t> bytes(data + at, std::min(portion, size - at));
    if (bytes[0] == 0x7F) {
      protocol->begin({}, stream);
      since_begin = 0;
    }
    whole -= since_begin / scan;
    since_begin += bytes.size();
    whole += since_begin / scan;
    protocol->take(bytes, std::chrono::seconds{1}, stream);
  }
  if (stream.counts.frames != whole) std::abort();
  if (stream.counts.readings != stream.readings.size()) std::abort();
  for (const DeviceReading& reading : stream.readings) {
    if (!plausible(reading)) std::abort();
  }
  return 0;
}
