#pragma once

#include <memory>
#include <string>

#include "core/expected.hpp"
#include "drivers/protocols/protocol_table.hpp"
#include "drivers/simulation/device_line.hpp"

namespace merkel {

/// The device's end of "tcp:HOST:PORT" (a server for one host) or "udp:HOST:PORT". For a protocol
/// with requests, the udp address is the device's; otherwise it is the host's, to which it sends.
[[nodiscard]] Expected<std::unique_ptr<DeviceLine>, SetupError> make_network_line(
    const std::string& address, const ProtocolEntry& protocol);

}  // namespace merkel
