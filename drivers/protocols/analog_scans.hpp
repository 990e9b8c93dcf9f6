#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// The conversion of a raw value of a data-acquisition card to V: a polynomial of raw − origin.
struct AnalogConversion {
  std::array<double, 4> coefficients{};  ///< of the powers 0 to 3
  double origin = 0.0;
  std::uint32_t largest = 0;  ///< raw value at the upper end of the range; 0 is the lower end

  [[nodiscard]] double volts(std::uint32_t raw) const noexcept {
    const double x = static_cast<double>(raw) - origin;
    const auto& c = coefficients;
    return c[0] + x * (c[1] + x * (c[2] + x * c[3]));
  }
};

/// The scans of a card: one raw value of each channel, of 2 or 4 bytes in the host's order, at
/// intervals of the card's clock.
struct AnalogFormat {
  std::vector<CsvColumn> columns;  ///< what the voltage of each channel means
  std::vector<AnalogConversion> conversions;
  std::size_t sample_bytes = 2;
  std::chrono::nanoseconds period{0};
};

/// Decodes scans. The device time of a scan is its number times the period, from 0 at begin().
/// A value at an end of its range counts as saturated.
[[nodiscard]] std::unique_ptr<Protocol> make_analog_scans(AnalogFormat format);

}  // namespace merkel
