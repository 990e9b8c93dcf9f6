#include "drivers/sinks/view/view_access.hpp"

#include <algorithm>
#include <array>

#include <arpa/inet.h>
#include <strings.h>
#include <sys/resource.h>
#include <unistd.h>

#include "drivers/transports/host_name.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMinViews = 8;

bool is_address(const std::string& host) {
  const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  const std::string bare = bracketed ? host.substr(1, host.size() - 2) : host;
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  return ::inet_pton(AF_INET, bare.c_str(), bytes.data()) == 1 ||
         ::inet_pton(AF_INET6, bare.c_str(), bytes.data()) == 1;
}

bool is_name_of_this_machine(const std::string& host) {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return false;
  const std::string local = std::string(name.data()) + ".local";
  return ::strcasecmp(host.c_str(), name.data()) == 0 ||
         ::strcasecmp(host.c_str(), local.c_str()) == 0;
}

}  // namespace

std::size_t most_view_sockets(std::size_t most) noexcept {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return most;
  return std::clamp<std::size_t>(limit.rlim_cur / 4, kMinViews, most);
}

bool may_view(std::string_view host, std::optional<std::string_view> origin, bool loopback_only) {
  auto address = HostAndPort::parse(host);
  if (!address) address = HostAndPort{.host = std::string(host), .port = 80};
  const bool ours =
      address->loopback() ||
      (!loopback_only && (is_address(address->host) || is_name_of_this_machine(address->host)));
  return ours && (!origin || *origin == "http://" + std::string(host));
}

bool has_view_token(std::string_view target, std::string_view token) noexcept {
  constexpr std::string_view kPrefix = "/socket?token=";
  if (token.empty() || !target.starts_with(kPrefix)) return false;
  const std::string_view given = target.substr(kPrefix.size());
  unsigned different = given.size() == token.size() ? 0U : 1U;
  for (std::size_t i = 0; i < std::min(given.size(), token.size()); ++i) {
    different |= static_cast<unsigned char>(given[i]) ^ static_cast<unsigned char>(token[i]);
  }
  return different == 0U;
}

}  // namespace merkel
