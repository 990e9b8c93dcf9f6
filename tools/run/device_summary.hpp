#pragma once

#include <optional>
#include <string>

#include "drivers/probe.hpp"
#include "tools/json_text.hpp"

namespace merkel {

/// The counters of a device's driver as indented lines of text.
[[nodiscard]] std::string device_text(const DeviceCounts& device);
/// The same as JSON; null for a probe that is not a device.
[[nodiscard]] nlohmann::json device_json(const std::optional<DeviceCounts>& device);

}  // namespace merkel
