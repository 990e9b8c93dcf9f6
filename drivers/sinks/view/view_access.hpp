#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace merkel {

/// Access control and connection limits of the live page.

/// The limit of open sockets: a quarter of the process's descriptors, at most `most`, so that
/// enough remain for devices.
[[nodiscard]] std::size_t most_view_sockets(std::size_t most) noexcept;

/// Rejects pages of other sites by the headers Host and Origin. A page on loopback is only reached
/// by a loopback name; another page by an address or by this machine's name, because another site's
/// name can be bound to this address (DNS rebinding).
/// \param origin  none: the header is missing, so that no browser asks
[[nodiscard]] bool may_view(std::string_view host, std::optional<std::string_view> origin,
                            bool loopback_only);

/// True if a target "/socket?token=…" has the token. Takes the same time for any wrong token.
[[nodiscard]] bool has_view_token(std::string_view target, std::string_view token) noexcept;

}  // namespace merkel
