#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/simulated_device.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// GRBL 1.1 (115200 Bd): a small CNC machine that carries the indenter. It is asked `?` and reports
/// its position; work coordinates are patch coordinates, so set the work zero (G10 L20) with the
/// tip on the skin at the patch's corner: z = −depth. Moving it is up to you. Options: `rate_hz` (1
/// to 100; default 20), `unit` = mm or in where `$13` cannot be asked.
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_grbl(UriOptions& options);
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_grbl_device();

}  // namespace merkel
