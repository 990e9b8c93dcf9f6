#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "drivers/files/owned_descriptor.hpp"
#include "drivers/transports/descriptor.hpp"
#include "drivers/transports/network_port.hpp"
#include "drivers/transports/socket.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr int kReceiveBuffer = 256 * 1024;
constexpr int kFlood = 200;                  ///< datagrams of others between two of the device
constexpr std::chrono::seconds kSilence{1};  ///< of a sender, before another port may follow it

class UdpPort final : public Transport {
 public:
  explicit UdpPort(UdpSettings settings) : settings_(std::move(settings)) {
    info_.name = "udp:" + text_of(settings_.address);
    describe();
  }

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
      if (count < 0) return std::size_t{0};  // nothing more, or no receiver at the other end
      const auto length = static_cast<std::size_t>(count);
      const bool fits = settings_.datagram_bytes == 0 ? length <= bytes.size()
                                                      : length == settings_.datagram_bytes;
      const auto now = std::chrono::steady_clock::now();
      if (!peer_ || started_again(sender, now)) peer_ = sender;
      if (sender.same_as(*peer_)) {
        heard_ = now;
        ignored_in_a_row_ = 0;
        if (fits) return length;
        ++info_.rejected;
        info_.newest_rejected.assign(
            bytes.begin(),
            bytes.begin() + static_cast<std::ptrdiff_t>(std::min(length, bytes.size())));
        continue;
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
    socket_.reset(::socket(local.storage.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (socket_.get() < 0) return refused(errno);
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVBUF, &kReceiveBuffer, sizeof kReceiveBuffer);
    if (::bind(socket_.get(), local.get(), local.length) != 0) return refused(errno);
    return {};
  }

 private:
  /// A program that sends lines gets another port when it starts again. Only the machine of the
  /// last sender may do so, and only after a silence.
  [[nodiscard]] bool started_again(const SocketAddress& sender,
                                   std::chrono::steady_clock::time_point now) const noexcept {
    return settings_.listen && sender.same_host(*peer_) && now - heard_ > kSilence;
  }
  /// A flood of other datagrams would fill the socket's buffer. If the socket is connected, the
  /// kernel drops them at once, uncounted.
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
  /// The local address at which a device at `remote` can answer: loopback if it is there.
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
    info_.note = "datagrams, " + std::to_string(ignored_) + " from other senders ignored";
    if (shut_off_) info_.note += ", then shut off";
  }

  UdpSettings settings_;
  OwnedDescriptor socket_;
  std::optional<SocketAddress> peer_;
  std::chrono::steady_clock::time_point heard_{};  ///< the peer's last datagram
  std::uint64_t ignored_ = 0;
  int ignored_in_a_row_ = 0;
  bool shut_off_ = false;  ///< the kernel lets the peer's datagrams through, and no others
};

}  // namespace

Expected<std::unique_ptr<Transport>, SetupError> open_udp_port(const UdpSettings& settings) {
  auto port = opened<UdpPort>(settings);
  if (port && settings.listen && !settings.allow_remote && !settings.address.loopback()) {
    return remote_refused("udp:" + text_of(settings.address), settings.address.host,
                          "send samples, the first of them as the device");
  }
  return port;
}

}  // namespace merkel
