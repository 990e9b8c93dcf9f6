#include <cerrno>
#include <cstring>
#include <utility>

#include <netinet/tcp.h>

#include "drivers/files/owned_descriptor.hpp"
#include "drivers/transports/descriptor.hpp"
#include "drivers/transports/network_port.hpp"
#include "drivers/transports/socket.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr std::chrono::seconds kConnectPatience{3};

class TcpPort final : public Transport {
 public:
  explicit TcpPort(HostAndPort server) : server_(std::move(server)) {
    info_.name = "tcp:" + text_of(server_);
    info_.note = "a TCP connection";
  }

  [[nodiscard]] Expected<std::size_t, Disconnected> read(std::span<std::uint8_t> bytes,
                                                         nanoseconds patience) override {
    const auto count = read_some(socket_.get(), bytes, patience);
    if (count && *count > 0) {
      // A device that collects its bytes until the last are acknowledged (Nagle) would wait for 40
      // ms. The kernel forgets this with every answer.
      const int on = 1;
      ::setsockopt(socket_.get(), IPPROTO_TCP, TCP_QUICKACK, &on, sizeof on);
    }
    return count;
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
      socket_.reset();
      return Unexpected<SetupError>(no_route(server_, std::strerror(number)));
    };
    socket_.reset(
        ::socket(address->storage.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (socket_.get() < 0) return failed(errno);
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
  OwnedDescriptor socket_;
};

}  // namespace

Expected<std::unique_ptr<Transport>, SetupError> open_tcp_port(const HostAndPort& server) {
  return opened<TcpPort>(server);
}

}  // namespace merkel
