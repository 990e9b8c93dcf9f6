#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/transports/transport.hpp"
#include "drivers/transports/usb_name.hpp"

namespace merkel {

enum class HidBackend { kHidraw, kLibusb };

/// Opens a HID device with hidapi; every read is one input report. The backend's library is loaded
/// when needed, because both backends define the same symbols.
[[nodiscard]] Expected<std::unique_ptr<Transport>, SetupError> open_hid_port(const UsbName& name,
                                                                             HidBackend backend);

}  // namespace merkel
