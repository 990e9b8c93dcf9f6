#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace merkel {

/// Who may use the live page, and how many at once.

/// How many sockets there may be: a quarter of the process's descriptors, at most `most`, so that
/// devices find theirs.
[[nodiscard]] std::size_t most_view_sockets(std::size_t most) noexcept;

/// Keeps pages of other sites out by the headers Host and Origin. A page that listens on loopback
/// is reached by a loopback name only; another one by an address or by this machine's name, because
/// another site's name can be bound to this address (DNS rebinding).
[[nodiscard]] bool may_view(std::string_view host, std::string_view origin, bool loopback_only);

/// Whether a target "/socket?token=…" carries the token. Takes the same time for every wrong one.
[[nodiscard]] bool has_view_token(std::string_view target, std::string_view token) noexcept;

}  // namespace merkel
