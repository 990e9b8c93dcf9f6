#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// One number in a HID input report: N, mm or ns = scale · (raw value) + bias.
struct HidField {
  enum class Kind : std::uint8_t { kValue, kTime, kSequence };
  Kind kind = Kind::kValue;
  ChannelName channel = {};  ///< of a value
  std::size_t offset = 0;    ///< of the lowest bit, after the report ID; little-endian
  std::size_t bits = 16;     ///< 1 to 32
  bool is_signed = false;
  double scale = 1.0;
  double bias = 0.0;
  /// The range of raw values, if the device reports it. Values at its ends are saturated.
  bool has_range = false;
  std::int64_t low = 0;
  std::int64_t high = 0;
};

/// The positions of the numbers in a device's reports.
struct HidFieldMap {
  std::vector<HidField> fields;
  std::uint8_t report_id = 0;  ///< 0: reports have no number
  double rate_Hz = 0.0;        ///< of the reports; 0: not known

  static constexpr std::size_t kMaxBits = 32;          ///< of a field
  static constexpr std::size_t kLastBit = 8U * 4096U;  ///< of the longest report
};

}  // namespace merkel
