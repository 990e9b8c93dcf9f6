#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/simulated_device.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// HBF1, the frame of our own firmware (drivers/firmware): units and scales come from the device's
/// HELLO, times from its latch, losses from its sequence numbers, and its clock is asked by SYNC.
/// Options: `rate_hz` (1 to 20000; the firmware's own, if not given).
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_hbf1(UriOptions& options);

/// \param channels  ProbeSample::Channel bits of the trace
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_hbf1_device(std::uint32_t channels);

}  // namespace merkel
