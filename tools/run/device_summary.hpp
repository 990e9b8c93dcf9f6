#pragma once

#include <optional>

#include "drivers/probe.hpp"
#include "tools/json_text.hpp"

namespace merkel {

/// For the text "timing".
[[nodiscard]] Json timing_json(const SampleTiming& timing);
/// The counters of a device's driver, for the text "device"; null for a probe that is not a device.
[[nodiscard]] Json device_json(const std::optional<DeviceCounts>& device);

}  // namespace merkel
