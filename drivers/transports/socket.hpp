#pragma once

#include <cstring>
#include <string>

#include <netinet/in.h>
#include <sys/socket.h>

#include "core/expected.hpp"
#include "drivers/transports/host_name.hpp"

namespace merkel {

/// An IPv4 or IPv6 address with a port.
struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t length = sizeof(sockaddr_storage);

  [[nodiscard]] const sockaddr* get() const noexcept {
    return reinterpret_cast<const sockaddr*>(&storage);
  }
  [[nodiscard]] sockaddr* get() noexcept { return reinterpret_cast<sockaddr*>(&storage); }
  [[nodiscard]] bool same_host(const SocketAddress& other) const noexcept {
    if (storage.ss_family != other.storage.ss_family) return false;
    if (storage.ss_family == AF_INET) {
      return as<sockaddr_in>().sin_addr.s_addr == other.as<sockaddr_in>().sin_addr.s_addr;
    }
    const sockaddr_in6 a = as<sockaddr_in6>();
    const sockaddr_in6 b = other.as<sockaddr_in6>();
    return std::memcmp(&a.sin6_addr, &b.sin6_addr, sizeof a.sin6_addr) == 0;
  }
  [[nodiscard]] bool same_as(const SocketAddress& other) const noexcept {
    // The port stands at the same place in both families.
    return same_host(other) && as<sockaddr_in>().sin_port == other.as<sockaddr_in>().sin_port;
  }

 private:
  template <class Address>
  [[nodiscard]] Address as() const noexcept {
    Address address{};
    std::memcpy(&address, &storage, sizeof address);
    return address;
  }
};

/// "HOST:PORT", "[::1]:PORT".
[[nodiscard]] std::string text_of(const HostAndPort& address);

/// The error of a host that cannot be reached.
[[nodiscard]] SetupError no_route(const HostAndPort& address, const std::string& why);

/// Looks up an address. \param type  SOCK_STREAM or SOCK_DGRAM
[[nodiscard]] Expected<SocketAddress, SetupError> resolve(const HostAndPort& address, int type);

}  // namespace merkel
