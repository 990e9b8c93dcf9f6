#pragma once

#include <cstddef>
#include <memory>

#include "core/expected.hpp"
#include "drivers/sinks/host_name.hpp"
#include "drivers/transports/transport.hpp"

namespace merkel {

/// Connects to a TCP server, such as a serial server. Connects again by itself after a break.
[[nodiscard]] Expected<std::unique_ptr<Transport>, SetupError> open_tcp_port(
    const HostAndPort& server);

/// How datagrams are exchanged with a device.
struct UdpSettings {
  HostAndPort address;
  /// True: the address is ours, and the first host that sends to it is the device. False: it is the
  /// device's, which answers what it is sent.
  bool listen = false;
  std::size_t datagram_bytes = 0;  ///< the only length that is accepted; any, if 0
};

/// Datagrams of other senders, or of another length, are left out; info().note counts them.
[[nodiscard]] Expected<std::unique_ptr<Transport>, SetupError> open_udp_port(
    const UdpSettings& settings);

}  // namespace merkel
