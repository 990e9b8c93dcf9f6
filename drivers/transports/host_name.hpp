#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/expected.hpp"

namespace merkel {

/// A host and a TCP or UDP port: "127.0.0.1:5557", "localhost:9000", "[::1]:9000".
struct HostAndPort {
  std::string host;
  std::uint16_t port = 0;

  /// Empty if the port is missing, 0 or not a number, or if the host is empty.
  [[nodiscard]] static std::optional<HostAndPort> parse(std::string_view text);

  /// True if the host is a loopback address or name.
  [[nodiscard]] bool loopback() const;
  /// True if the host is an address or a name that resolves. May take seconds.
  [[nodiscard]] bool known() const;
};

/// The error for an address that --allow-remote would allow.
/// \param action  of other machines
[[nodiscard]] Unexpected<SetupError> remote_refused(const std::string& uri, const std::string& host,
                                                    const std::string& action = "receive the data");

}  // namespace merkel
