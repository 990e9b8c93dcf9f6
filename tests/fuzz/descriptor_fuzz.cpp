// Arbitrary bytes as a HID report descriptor, then as a report of the described device. Built
// and run by fuzz.sh with libFuzzer.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "drivers/protocols/hid_fields.hpp"
#include "drivers/protocols/hid_report_descriptor.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  const std::span<const std::uint8_t> bytes(data, size);
  auto map = map_report_descriptor(bytes);
  if (!map) return 0;
  for (const HidField& field : map->fields) {
    if (field.bits == 0 || field.offset + field.bits > HidFieldMap::kLastBit) std::abort();
  }
  const auto protocol = make_hid_fields(std::move(*map));
  DeviceStream stream;
  protocol->take(bytes, std::chrono::nanoseconds{1}, stream);
  for (const DeviceReading& reading : stream.readings) {
    if (!plausible(reading)) std::abort();
  }
  return 0;
}
