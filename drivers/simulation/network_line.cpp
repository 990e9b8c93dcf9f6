#include "drivers/simulation/network_line.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/protocols/protocol_makers.hpp"
#include "drivers/transports/descriptor.hpp"
#include "drivers/transports/host_name.hpp"
#include "drivers/uri.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t kLargestDatagram = 1200;

/// Simulated devices are only reachable from this machine.
std::optional<sockaddr_in> loopback_of(const HostAndPort& address) {
  if (!address.loopback() || address.host == "::1") return std::nullopt;
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(address.port);
  result.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return result;
}

const sockaddr* generic(const sockaddr_in& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

SetupError cannot(const std::string& address) {
  return {.kind = SetupError::Kind::kUnavailable,
          .sentence = "cannot use " + address + ": " + std::strerror(errno)};
}

class TcpLine final : public DeviceLine {
 public:
  TcpLine(std::string address, const sockaddr_in& own) : address_(std::move(address)), own_(own) {}
  ~TcpLine() override { unplug(); }

  [[nodiscard]] Expected<void, SetupError> plug_in() override {
    server_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const int on = 1;
    ::setsockopt(server_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (server_ < 0 || ::bind(server_, generic(own_), sizeof own_) != 0 ||
        ::listen(server_, 1) != 0) {
      return Unexpected<SetupError>(cannot(address_));
    }
    return {};
  }
  void unplug() noexcept override {
    if (host_ >= 0) ::close(std::exchange(host_, -1));
    if (server_ >= 0) ::close(std::exchange(server_, -1));
  }
  [[nodiscard]] std::string address() const override { return address_; }
  [[nodiscard]] bool heard() const noexcept override { return host_ >= 0; }
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> bytes,
                                 nanoseconds patience) noexcept override {
    const int waited = host_ >= 0 ? host_ : server_;
    if (waited < 0 || wait_readable(waited, patience) == Readiness::kTimeout) return 0;
    if (host_ < 0) {
      host_ = ::accept4(server_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
      return 0;
    }
    const auto count = ::recv(host_, bytes.data(), bytes.size(), 0);
    if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) {
      ::close(std::exchange(host_, -1));
    }
    return count > 0 ? static_cast<std::size_t>(count) : 0;
  }
  std::size_t write(std::span<const std::uint8_t> bytes) noexcept override {
    if (host_ < 0) return 0;
    const auto count = ::send(host_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    return count > 0 ? static_cast<std::size_t>(count) : 0;
  }

 private:
  std::string address_;
  sockaddr_in own_;
  int server_ = -1;
  int host_ = -1;
};

class UdpLine final : public DeviceLine {
 public:
  /// \param record_bytes  size of a datagram of a polled device; 0: sends lines to the host
  UdpLine(std::string address, const sockaddr_in& given, std::size_t record_bytes)
      : address_(std::move(address)), given_(given), record_bytes_(record_bytes) {}
  ~UdpLine() override { unplug(); }

  [[nodiscard]] Expected<void, SetupError> plug_in() override {
    sockaddr_in own = given_;
    if (record_bytes_ == 0) {
      own.sin_port = 0;
      host_ = given_;
    }
    socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (socket_ < 0 || ::bind(socket_, generic(own), sizeof own) != 0) {
      return Unexpected<SetupError>(cannot(address_));
    }
    if (record_bytes_ == 0 && ::connect(socket_, generic(*host_), sizeof *host_) != 0) {
      return Unexpected<SetupError>(cannot(address_));
    }
    return {};
  }
  void unplug() noexcept override {
    if (socket_ >= 0) ::close(std::exchange(socket_, -1));
  }
  [[nodiscard]] std::string address() const override { return address_; }
  [[nodiscard]] bool heard() const noexcept override {
    // Lines are sent without a request; they are refused until a host is there.
    return record_bytes_ > 0 ? host_.has_value() : !refused_;
  }
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> bytes,
                                 nanoseconds patience) noexcept override {
    if (record_bytes_ == 0 && refused_) probe_host();
    if (socket_ < 0 || wait_readable(socket_, patience) != Readiness::kReady) return 0;
    sockaddr_in sender{};
    socklen_t length = sizeof sender;
    const auto count = ::recvfrom(socket_, bytes.data(), bytes.size(), 0,
                                  reinterpret_cast<sockaddr*>(&sender), &length);
    if (count <= 0) return 0;
    if (record_bytes_ > 0) host_ = sender;
    return static_cast<std::size_t>(count);
  }
  std::size_t write(std::span<const std::uint8_t> bytes) noexcept override {
    if (socket_ < 0 || !host_) return 0;
    const std::size_t most = record_bytes_ > 0 ? record_bytes_ : kLargestDatagram;
    std::size_t sent = 0;
    while (sent < bytes.size()) {
      const auto datagram = bytes.subspan(sent, std::min(most, bytes.size() - sent));
      const bool connected = record_bytes_ == 0;
      if (::sendto(socket_, datagram.data(), datagram.size(), MSG_NOSIGNAL,
                   connected ? nullptr : generic(*host_), connected ? 0 : sizeof *host_) < 0) {
        break;
      }
      sent += datagram.size();
    }
    return sent;
  }

 private:
  /// A connected socket reports at its second datagram that there is no receiver.
  void probe_host() noexcept {
    const char end_of_line = '\n';
    static_cast<void>(::send(socket_, &end_of_line, 1, MSG_NOSIGNAL));
    refused_ = ::send(socket_, &end_of_line, 1, MSG_NOSIGNAL) < 0;
  }

  std::string address_;
  sockaddr_in given_;
  std::size_t record_bytes_;
  std::optional<sockaddr_in> host_;
  bool refused_ = true;
  int socket_ = -1;
};

}  // namespace

Expected<std::unique_ptr<DeviceLine>, SetupError> make_network_line(const std::string& address,
                                                                    const ProtocolEntry& protocol) {
  const auto uri = Uri::parse(address);
  if (!uri) return Unexpected<SetupError>(uri.error());
  const auto parsed = HostAndPort::parse(uri->path);
  const auto loopback = parsed ? loopback_of(*parsed) : std::nullopt;
  if (!loopback || (uri->scheme != "tcp" && uri->scheme != "udp")) {
    return bad_input("\"" + address +
                     "\" is not an address for a simulated device: write udp:127.0.0.1:PORT or "
                     "tcp:127.0.0.1:PORT");
  }
  if (uri->scheme == "tcp") return std::make_unique<TcpLine>(address, *loopback);
  return std::make_unique<UdpLine>(address, *loopback, protocol.datagrams ? kAtiRecordBytes : 0);
}

}  // namespace merkel
