#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/expected.hpp"
#include "drivers/sinks/view/view_request.hpp"

namespace merkel {

/// Serves the live page and sends its frames to every connected browser, from its own thread.
///
/// A slow client gets the newest frame as soon as it is ready, with the number of frames it missed.
/// A client that reads nothing for 20 s is disconnected. Nothing waits for clients. Connections are
/// limited: a new one displaces the oldest one without a request, and all together use at most a
/// quarter of the process's file descriptors.
class ViewServer {
 public:
  struct Parameters {
    std::string host = "127.0.0.1";
    std::uint16_t port = 8080;
    std::string hello;           ///< sent first to every client
    std::string steering_hello;  ///< sent instead to a client with the token
    std::string token;           ///< empty: no client may control the run
    /// Called with each valid and permitted request. Must not block. Thread: server.
    std::function<void(const ViewRequest&)> on_request = {};
  };

  /// Listens and starts the thread. Fails if the port is in use.
  [[nodiscard]] static Expected<std::unique_ptr<ViewServer>, SetupError> start(
      const Parameters& parameters);
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;
  /// Stops without waiting for clients.
  ~ViewServer();

  /// Sends a frame to every client. Thread: any.
  /// \param first  discards earlier frames, which new clients would receive
  void publish(std::string frame, bool first = false);
  /// Sends queued frames for at most half a second, and stops.
  void finish();

 private:
  class Thread;
  explicit ViewServer(std::unique_ptr<Thread> thread);
  std::unique_ptr<Thread> thread_;
};

}  // namespace merkel
