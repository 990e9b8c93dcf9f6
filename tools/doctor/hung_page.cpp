#include "tools/doctor/hung_page.hpp"

#include <cerrno>
#include <cstring>
#include <string>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "drivers/sinks/open_sink.hpp"

namespace merkel {
namespace {

constexpr int kReceiveBuffer = 2048;  ///< bytes; the most that a hung browser accepts

SetupError no_page(const std::string& why) {
  return {.kind = SetupError::Kind::kUnavailable,
          .sentence = "cannot open the live page for the test browsers: " + why};
}

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

/// A free port, found by opening and closing a socket; 0 if there is none.
std::uint16_t free_port() {
  const OwnedDescriptor scout(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address = loopback(0);
  socklen_t length = sizeof address;
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  if (::bind(scout.get(), generic, length) != 0) return 0;
  if (::getsockname(scout.get(), generic, &length) != 0) return 0;
  return ntohs(address.sin_port);
}

}  // namespace

Expected<HungPage, SetupError> HungPage::open(const TactileModel& model) {
  const std::uint16_t port = free_port();
  if (port == 0) {
    return Unexpected<SetupError>(no_page(std::string("no port is free: ") + std::strerror(errno)));
  }
  SinkSetup setup{.neurons = static_cast<std::uint32_t>(model.neurons())};
  setup.run.scene = "doctor";
  setup.run.model = model.parameters();
  const std::string name = std::to_string(port);
  auto sink = open_sink("view:" + name, setup);
  if (!sink) return Unexpected<SetupError>(sink.error());
  const std::string request = "GET /socket HTTP/1.1\r\nHost: 127.0.0.1:" + name +
                              "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                              "Sec-WebSocket-Key: bWVya2VsLWRvY3Rvci1wZw==\r\n"
                              "Sec-WebSocket-Version: 13\r\nOrigin: http://127.0.0.1:" +
                              name + "\r\n\r\n";
  std::vector<OwnedDescriptor> browsers;
  for (int k = 0; k < kBrowsers; ++k) {
    OwnedDescriptor browser(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    const sockaddr_in address = loopback(port);
    // Before connect(), which announces the size to the peer.
    if (::setsockopt(browser.get(), SOL_SOCKET, SO_RCVBUF, &kReceiveBuffer,
                     sizeof kReceiveBuffer) != 0 ||
        ::connect(browser.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) !=
            0 ||
        ::send(browser.get(), request.data(), request.size(), MSG_NOSIGNAL) !=
            static_cast<ssize_t>(request.size())) {
      return Unexpected<SetupError>(no_page(std::strerror(errno)));
    }
    browsers.push_back(std::move(browser));
  }
  return HungPage(std::move(*sink), std::move(browsers));
}

}  // namespace merkel
