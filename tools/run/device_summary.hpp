#pragma once

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "drivers/probe.hpp"

namespace merkel {

/// What a device's driver counted, for people: indented lines.
[[nodiscard]] std::string device_text(const DeviceCounts& device);
/// The same for programs; null for what is no device.
[[nodiscard]] nlohmann::json device_json(const std::optional<DeviceCounts>& device);

}  // namespace merkel
