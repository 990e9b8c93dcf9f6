#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/transports/transport.hpp"
#include "drivers/transports/usb_name.hpp"

namespace merkel {

enum class HidBackend { kHidraw, kLibusb };

/// Opens a HID device by hidapi; every read is one input report. The backend's library is loaded
/// when it is needed, as both have the same names inside.
[[nodiscard]] Expected<std::unique_ptr<Transport>, SetupError> open_hid_port(const UsbName& name,
                                                                             HidBackend backend);

}  // namespace merkel
