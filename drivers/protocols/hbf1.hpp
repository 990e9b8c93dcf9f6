#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/simulated_device.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// HBF1, the protocol of the project's firmware (drivers/firmware). The device's HELLO gives units
/// and scales, its latch the times, its sequence numbers the losses, and SYNC requests its clock.
/// Options: `rate_hz` (1 to 20000; default: the firmware's).
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_hbf1(UriOptions& options);

/// \param channels  ProbeSample::Channel bits of the trace
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_hbf1_device(std::uint32_t channels);

}  // namespace merkel
