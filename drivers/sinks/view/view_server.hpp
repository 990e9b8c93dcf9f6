#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/expected.hpp"

namespace merkel {

/// Serves the live page and sends its frames to every browser that looks, on a thread of its own.
///
/// A client that does not keep up gets the newest frame when it is ready again, and is told how
/// many it has missed. Whatever clients do, nobody else waits for them.
class ViewServer {
 public:
  struct Parameters {
    std::string host = "127.0.0.1";
    std::uint16_t port = 8080;
    std::string hello;  ///< what every client is sent first
    /// Other names than those of this machine may be in a request's Host.
    bool allow_remote = false;
  };

  /// Listens, and starts the thread. Fails where the port is in use.
  [[nodiscard]] static Expected<std::unique_ptr<ViewServer>, SetupError> start(
      Parameters parameters);
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;
  /// Stops, without waiting for clients.
  ~ViewServer();

  /// Hands a frame to every client. Thread: any.
  void publish(std::string frame);
  /// Lets clients take what they were sent, for half a second at most, and stops.
  void finish();

 private:
  class Thread;
  explicit ViewServer(std::unique_ptr<Thread> thread);
  std::unique_ptr<Thread> thread_;
};

}  // namespace merkel
