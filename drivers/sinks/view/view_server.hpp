#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/expected.hpp"
#include "drivers/sinks/view/view_request.hpp"

namespace merkel {

/// Serves the live page and sends its frames to every connected browser, on a thread of its own.
///
/// A client that does not keep up gets the newest frame when it is ready again, with the number of
/// frames it missed. A client that takes nothing for 20 s is disconnected. Nothing waits for
/// clients. Connections are bounded: a new one displaces the oldest that has not been served, and
/// all of them together use at most a quarter of the process's file descriptors.
class ViewServer {
 public:
  struct Parameters {
    std::string host = "127.0.0.1";
    std::uint16_t port = 8080;
    std::string hello;           ///< sent first to every client
    std::string steering_hello;  ///< sent instead to a client that has the token
    std::string token;           ///< empty: no client may steer
    /// Called with each valid request that the client may make. Must not block. Thread: server.
    std::function<void(const ViewRequest&)> on_request = {};
  };

  /// Listens and starts the thread. Fails where the port is in use.
  [[nodiscard]] static Expected<std::unique_ptr<ViewServer>, SetupError> start(
      Parameters parameters);
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;
  /// Stops without waiting for clients.
  ~ViewServer();

  /// Hands a frame to every client. Thread: any.
  /// \param first  forgets all frames before it, which new clients would be sent
  void publish(std::string frame, bool first = false);
  /// Sends clients what is still queued, for half a second at most, and stops.
  void finish();

 private:
  class Thread;
  explicit ViewServer(std::unique_ptr<Thread> thread);
  std::unique_ptr<Thread> thread_;
};

}  // namespace merkel
