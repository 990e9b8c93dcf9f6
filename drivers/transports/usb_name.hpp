#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/expected.hpp"

namespace merkel {

/// Identifies a USB device: VID:PID in hexadecimal and, if there are several, the serial number.
struct UsbName {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string serial_number;  ///< empty: any

  [[nodiscard]] static Expected<UsbName, SetupError> parse(std::string_view text,
                                                           std::string serial_number);
  /// "16c0:0486"
  [[nodiscard]] std::string text() const;
};

/// The device node of a USB device: "/dev/bus/usb/001/002".
[[nodiscard]] std::string usb_node(long bus, long address);

}  // namespace merkel
