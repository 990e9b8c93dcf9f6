#include "drivers/transports/socket.hpp"

#include <netdb.h>

namespace merkel {

std::string text_of(const HostAndPort& address) {
  const bool colons = address.host.find(':') != std::string::npos;
  return (colons ? "[" + address.host + "]" : address.host) + ":" + std::to_string(address.port);
}

SetupError no_route(const HostAndPort& address, const std::string& why) {
  return {.kind = SetupError::Kind::kUnavailable,
          .sentence = "cannot reach " + text_of(address) + ": " + why +
                      "; check the address, the cable and the device's network settings"};
}

Expected<SocketAddress, SetupError> resolve(const HostAndPort& address, int type) {
  addrinfo hints{};
  hints.ai_socktype = type;
  hints.ai_flags = AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const std::string port = std::to_string(address.port);
  const int failed = ::getaddrinfo(address.host.c_str(), port.c_str(), &hints, &found);
  if (failed != 0) return Unexpected<SetupError>(no_route(address, ::gai_strerror(failed)));
  SocketAddress result;
  std::memcpy(&result.storage, found->ai_addr, found->ai_addrlen);
  result.length = found->ai_addrlen;
  ::freeaddrinfo(found);
  return result;
}

}  // namespace merkel
