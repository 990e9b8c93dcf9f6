#include "drivers/transports/host_name.hpp"

#include <array>

#include <arpa/inet.h>
#include <netdb.h>

#include "drivers/parsed_number.hpp"

namespace merkel {

std::optional<HostAndPort> HostAndPort::parse(std::string_view text) {
  const auto colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0) return std::nullopt;
  HostAndPort address;
  std::string_view host = text.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  address.host = host;
  const std::string_view port = text.substr(colon + 1);
  address.port = parsed_number<decltype(address.port)>(port).value_or(0);
  if (address.port == 0) return std::nullopt;
  return address;
}

bool HostAndPort::loopback() const {
  if (host == "localhost") return true;
  // Only a complete address counts: 127.evil.example is a name.
  std::array<unsigned char, 16> bytes{};
  if (::inet_pton(AF_INET, host.c_str(), bytes.data()) == 1) return bytes[0] == 127;
  return host == "::1";
}

bool HostAndPort::known() const {
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), nullptr, nullptr, &found) != 0) return false;
  ::freeaddrinfo(found);
  return true;
}

Unexpected<SetupError> remote_refused(const std::string& uri, const std::string& host,
                                      const std::string& action) {
  return bad_input(
      "\"" + uri + "\": " + host +
      " is not a loopback address of this machine: add --allow-remote if other machines may " +
      action + ", or use 127.0.0.1");
}

}  // namespace merkel
