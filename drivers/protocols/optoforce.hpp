#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/simulated_device.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// OptoForce DAQ with a 3-axis sensor (1 000 000 Bd), streaming 16-byte frames. Options:
/// `counts_per_N` (for all axes, from the sensor's calibration sheet; or `counts_per_N_x`, `_y` and
/// `_z`), `rate_hz` (10 to 1000, a divisor of 1000; default 1000), `filter` (0 to 6; default 4).
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_optoforce(UriOptions& options);

/// A sensor with 1024 counts per N.
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_optoforce_device();

}  // namespace merkel
