#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/simulated_device.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// GRBL 1.1 (115200 Bd): a small CNC machine that carries the indenter. The host sends `?`, and the
/// machine reports its position. Work coordinates are patch coordinates: set the work zero (G10
/// L20) with the tip on the skin at the corner of the patch, so that z = −depth. The user moves the
/// machine. Options: `rate_hz` (1 to 100; default 25), `unit` = mm or in if `$13` is not available.
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_grbl(UriOptions& options);
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_grbl_device();

}  // namespace merkel
