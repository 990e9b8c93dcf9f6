#pragma once

#include <cstddef>
#include <memory>

#include "core/expected.hpp"
#include "drivers/transports/host_name.hpp"
#include "drivers/transports/transport.hpp"

namespace merkel {

/// Connects to a TCP server, such as a serial server. Reconnects automatically after an
/// interruption.
[[nodiscard]] Expected<std::unique_ptr<Transport>, SetupError> open_tcp_port(
    const HostAndPort& server);

/// The exchange of datagrams with a device.
struct UdpSettings {
  HostAndPort address;
  /// True: a local address; the first program that sends to it is the device, and after a second of
  /// silence another program of the same machine may take its place. False: the address of the
  /// device, which answers requests.
  bool listen = false;
  bool allow_remote = false;       ///< a local address may be open to other machines
  std::size_t datagram_bytes = 0;  ///< the only accepted length; 0: any
};

/// Datagrams of other senders are ignored and counted in info().note; those of another length are
/// in info().rejected. Fails for a local address that is not loopback, unless `allow_remote`:
/// whoever sends first is the device.
[[nodiscard]] Expected<std::unique_ptr<Transport>, SetupError> open_udp_port(
    const UdpSettings& settings);

}  // namespace merkel
