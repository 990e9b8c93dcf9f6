#pragma once

#include <cstddef>
#include <memory>

#include "core/expected.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/simulated_device.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// ATI Net F/T, raw data transfer over UDP: each datagram is one record of 36 bytes, big-endian:
/// RDT sequence, F/T sequence, status, Fx, Fy, Fz, Tx, Ty, Tz in counts. Compression is positive
/// Fz. Options: `counts_per_N` (default 1000000, the box's usual setting; its web page shows it),
/// `rate_hz` (the box's setting; its sequence numbers then serve as its clock). Torques are
/// ignored.
[[nodiscard]] Expected<std::unique_ptr<Protocol>, SetupError> make_ati_rdt(UriOptions& options);
[[nodiscard]] std::unique_ptr<SimulatedDevice> make_ati_rdt_device(std::uint32_t channels);

inline constexpr std::size_t kAtiRecordBytes = 36;

}  // namespace merkel
