#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/transports/transport.hpp"
#include "drivers/transports/usb_name.hpp"

namespace merkel {

/// Where in a USB device the bytes are.
struct UsbEndpoints {
  int interface = 0;
  std::uint8_t in = 0x81;
  std::uint8_t out = 0x01;  ///< 0: the device is not written to
  bool interrupt = false;   ///< else bulk
};

/// Opens an interface of a USB device by libusb: several transfers are always under way, so that
/// none is missed between two reads; a stalled endpoint is cleared.
[[nodiscard]] Expected<std::unique_ptr<Transport>, SetupError> open_usb_port(
    const UsbName& name, const UsbEndpoints& endpoints);

}  // namespace merkel
