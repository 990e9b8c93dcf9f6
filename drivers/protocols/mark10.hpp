#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/simulated_device.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Mark-10 force gauges of series 5 and 7 (GCL2, ASCII, 115200 Bd), streaming with units.
/// Compression is positive. Options: `rate_hz` (2, 5, 10, 25, 50, 125 or 250; default 250), `unit`
/// of readings without one.
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_mark10(UriOptions& options);
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_mark10_device();

/// Mark-10 test stands ESM301 and ESM303 with their gauge, polled: force, and travel, which is the
/// depth if it is zeroed at contact. Option: `rate_hz` (1 to 50; default 25).
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_esm(UriOptions& options);
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_esm_device(std::uint32_t channels);

}  // namespace merkel
