#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/simulated_device.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Zaber linear stages (ASCII protocol, 115200 Bd), polled for their position. Options:
/// `um_per_step` (length of a microstep, from the stage's data sheet; required), `axis` of the
/// patch (depth, x, y or z; default depth), `address` (1) and `stage_axis` (1) on the chain,
/// `rate_hz` (1 to 200; default 50).
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_zaber(UriOptions& options);

/// A stage with microsteps of 1/1024 mm.
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_zaber_device();

}  // namespace merkel
