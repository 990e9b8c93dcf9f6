#pragma once

#include <optional>
#include <string>

#include "drivers/probe.hpp"
#include "tools/json_text.hpp"

namespace merkel {

/// "rate: 500 samples/s with 0.1 ms of jitter; loop delay in a run: 2.2 ms", a line.
[[nodiscard]] std::string timing_text(const SampleTiming& timing);
/// The counters of a device's driver as indented lines of text.
[[nodiscard]] std::string device_text(const DeviceCounts& device);
/// The same as JSON; null for a probe that is not a device.
[[nodiscard]] nlohmann::json device_json(const std::optional<DeviceCounts>& device);

}  // namespace merkel
