#include "drivers/transports/network_port.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/transports/descriptor.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr std::chrono::seconds kConnectPatience{3};
constexpr int kReceiveBuffer = 256 * 1024;
constexpr int kFlood = 200;                  ///< datagrams of others between two of the device
constexpr std::chrono::seconds kSilence{1};  ///< of a sender, before another port may follow it

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

class Socket {
 public:
  Socket() = default;
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() { close(); }

  bool open(int family, int type) noexcept {
    close();
    descriptor_ = ::socket(family, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    return descriptor_ >= 0;
  }
  void close() noexcept {
    if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
  }
  [[nodiscard]] int get() const noexcept { return descriptor_; }

 private:
  int descriptor_ = -1;
};

class TcpPort final : public Transport {
 public:
  explicit TcpPort(HostAndPort server) : server_(std::move(server)) {
    info_.name = "tcp:" + text_of(server_);
    info_.note = "a TCP connection";
  }

  [[nodiscard]] const TransportInfo& info() const noexcept override { return info_; }

  [[nodiscard]] Expected<std::size_t, Disconnected> read(std::span<std::uint8_t> bytes,
                                                         nanoseconds patience) override {
    switch (wait_readable(socket_.get(), patience)) {
      case Readiness::kTimeout:
        return std::size_t{0};
      case Readiness::kGone:
        return Unexpected<Disconnected>(Disconnected{});
      case Readiness::kReady:
        break;
    }
    const auto count = ::recv(socket_.get(), bytes.data(), bytes.size(), 0);
    if (count > 0) {
      // A device that collects its bytes until the last are acknowledged (Nagle) would wait for 40
      // ms. The kernel forgets this with every answer.
      const int on = 1;
      ::setsockopt(socket_.get(), IPPROTO_TCP, TCP_QUICKACK, &on, sizeof on);
      return static_cast<std::size_t>(count);
    }
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return std::size_t{0};
    return Unexpected<Disconnected>(Disconnected{});
  }

  [[nodiscard]] Expected<void, Disconnected> write(std::span<const std::uint8_t> bytes) override {
    while (!bytes.empty()) {
      const auto sent = ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent > 0) {
        bytes = bytes.subspan(static_cast<std::size_t>(sent));
        continue;
      }
      const bool full = sent < 0 && (errno == EAGAIN || errno == EINTR);
      if (!full || wait_writable(socket_.get(), kConnectPatience) != Readiness::kReady) {
        return Unexpected<Disconnected>(Disconnected{});
      }
    }
    return {};
  }

  [[nodiscard]] Expected<void, SetupError> reopen() override {
    const auto address = resolve(server_, SOCK_STREAM);
    if (!address) return Unexpected<SetupError>(address.error());
    const auto failed = [&](int number) {
      socket_.close();
      return Unexpected<SetupError>(no_route(server_, std::strerror(number)));
    };
    if (!socket_.open(address->storage.ss_family, SOCK_STREAM)) return failed(errno);
    if (::connect(socket_.get(), address->get(), address->length) != 0) {
      if (errno != EINPROGRESS) return failed(errno);
      if (wait_writable(socket_.get(), kConnectPatience) == Readiness::kTimeout) {
        return failed(ETIMEDOUT);
      }
      int error = 0;
      socklen_t length = sizeof error;
      ::getsockopt(socket_.get(), SOL_SOCKET, SO_ERROR, &error, &length);
      if (error != 0) return failed(error);
    }
    const int on = 1;
    ::setsockopt(socket_.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
    return {};
  }

 private:
  HostAndPort server_;
  TransportInfo info_;
  Socket socket_;
};

class UdpPort final : public Transport {
 public:
  explicit UdpPort(UdpSettings settings) : settings_(std::move(settings)) {
    info_.name = "udp:" + text_of(settings_.address);
    describe();
  }

  [[nodiscard]] const TransportInfo& info() const noexcept override { return info_; }

  /// One datagram at a time.
  [[nodiscard]] Expected<std::size_t, Disconnected> read(std::span<std::uint8_t> bytes,
                                                         nanoseconds patience) override {
    // Only a sender of lines may return with another port; a disconnected socket loses its own.
    if (shut_off_ && settings_.listen && std::chrono::steady_clock::now() - heard_ > kSilence) {
      open_to_all();
    }
    // An error of a connected socket is fetched too: it would be reported again and again.
    if (wait_readable(socket_.get(), patience) == Readiness::kTimeout) return std::size_t{0};
    // Datagrams of other senders must not delay the device's.
    for (int tries = 0; tries < 64; ++tries) {
      SocketAddress sender;
      const auto count = ::recvfrom(socket_.get(), bytes.data(), bytes.size(), MSG_TRUNC,
                                    sender.get(), &sender.length);
      if (count < 0) return std::size_t{0};  // nothing more, or an answer that nobody is there
      const auto length = static_cast<std::size_t>(count);
      const bool fits = settings_.datagram_bytes == 0 ? length <= bytes.size()
                                                      : length == settings_.datagram_bytes;
      const auto now = std::chrono::steady_clock::now();
      if (!peer_ || started_again(sender, now)) peer_ = sender;
      if (sender.same_as(*peer_) && fits) {
        heard_ = now;
        ignored_in_a_row_ = 0;
        return length;
      }
      ++ignored_;
      describe();
      if (++ignored_in_a_row_ == kFlood) shut_off_others();
    }
    return std::size_t{0};
  }

  [[nodiscard]] Expected<void, Disconnected> write(std::span<const std::uint8_t> bytes) override {
    if (!peer_) return {};  // the device has not sent anything yet
    static_cast<void>(::sendto(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL,
                               peer_->get(), peer_->length));
    return {};
  }

  [[nodiscard]] Expected<void, SetupError> reopen() override {
    const auto address = resolve(settings_.address, SOCK_DGRAM);
    if (!address) return Unexpected<SetupError>(address.error());
    SocketAddress local = *address;
    if (!settings_.listen) {
      peer_ = *address;
      local = any_port_for(*address);
    }
    const auto refused = [&](int number) {
      return unavailable("cannot receive at " + text_of(settings_.address) + ": " +
                         std::strerror(number) +
                         "; use an address of this machine and a free port");
    };
    shut_off_ = false;
    if (!socket_.open(local.storage.ss_family, SOCK_DGRAM)) return refused(errno);
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVBUF, &kReceiveBuffer, sizeof kReceiveBuffer);
    if (::bind(socket_.get(), local.get(), local.length) != 0) return refused(errno);
    return {};
  }

 private:
  /// A program that sends lines gets another port when it starts again. Only the machine that was
  /// heard before may do so, and only after it was silent.
  [[nodiscard]] bool started_again(const SocketAddress& sender,
                                   std::chrono::steady_clock::time_point now) const noexcept {
    return settings_.listen && sender.same_host(*peer_) && now - heard_ > kSilence;
  }
  /// A flood of others would fill the socket's buffer: the kernel drops them at once, uncounted,
  /// where the socket is connected.
  void shut_off_others() noexcept {
    shut_off_ = ::connect(socket_.get(), peer_->get(), peer_->length) == 0;
    heard_ = std::chrono::steady_clock::now();
    describe();
  }
  void open_to_all() noexcept {
    sockaddr none{};
    none.sa_family = AF_UNSPEC;
    ::connect(socket_.get(), &none, sizeof none);
    shut_off_ = false;
    ignored_in_a_row_ = 0;
  }
  /// Where a device at `remote` can answer: on loopback where it is there itself.
  SocketAddress any_port_for(const SocketAddress& remote) const noexcept {
    SocketAddress local = remote;
    if (remote.storage.ss_family == AF_INET) {
      sockaddr_in address{};
      address.sin_family = AF_INET;
      address.sin_addr.s_addr = htonl(settings_.address.loopback() ? INADDR_LOOPBACK : INADDR_ANY);
      std::memcpy(&local.storage, &address, sizeof address);
    } else {
      sockaddr_in6 address{};
      address.sin6_family = AF_INET6;
      address.sin6_addr = settings_.address.loopback() ? in6addr_loopback : in6addr_any;
      std::memcpy(&local.storage, &address, sizeof address);
    }
    return local;
  }
  void describe() {
    info_.note = "datagrams, " + std::to_string(ignored_) + " of other senders ignored";
    if (shut_off_) info_.note += ", then shut off";
  }

  UdpSettings settings_;
  TransportInfo info_;
  Socket socket_;
  std::optional<SocketAddress> peer_;
  std::chrono::steady_clock::time_point heard_{};  ///< the peer's last datagram
  std::uint64_t ignored_ = 0;
  int ignored_in_a_row_ = 0;
  bool shut_off_ = false;  ///< the kernel lets the peer's datagrams through, and no others
};

template <class Port, class Settings>
Expected<std::unique_ptr<Transport>, SetupError> opened(const Settings& settings) {
  auto port = std::make_unique<Port>(settings);
  if (auto done = port->reopen(); !done) return Unexpected<SetupError>(done.error());
  return port;
}

}  // namespace

Expected<std::unique_ptr<Transport>, SetupError> open_tcp_port(const HostAndPort& server) {
  return opened<TcpPort>(server);
}

Expected<std::unique_ptr<Transport>, SetupError> open_udp_port(const UdpSettings& settings) {
  return opened<UdpPort>(settings);
}

}  // namespace merkel
