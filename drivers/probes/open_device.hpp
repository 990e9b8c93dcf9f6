#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/probe.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Opens serial:DEVICE?protocol=NAME&baud=RATE&… with the options of the protocol and those of
/// every device (DeviceProbe::settings_from).
[[nodiscard]] Expected<std::unique_ptr<Probe>, SetupError> open_serial_device(const Uri& uri);

}  // namespace merkel
