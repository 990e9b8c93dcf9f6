#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/transports/transport.hpp"
#include "drivers/transports/usb_name.hpp"

namespace merkel {

/// The interface and endpoints of a USB device.
struct UsbEndpoints {
  int interface = 0;
  std::uint8_t in = 0x81;
  std::uint8_t out = 0x01;  ///< 0: the device is not written to
  bool interrupt = false;   ///< else bulk
};

/// Opens an interface of a USB device with libusb. Several transfers are always submitted, so that
/// no data is missed between two reads. A stalled endpoint is cleared.
[[nodiscard]] Expected<std::unique_ptr<Transport>, SetupError> open_usb_port(
    const UsbName& name, const UsbEndpoints& endpoints);

}  // namespace merkel
