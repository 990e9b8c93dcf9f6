#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <set>
#include <string>

#include "drivers/sinks/view/view_request.hpp"

namespace merkel {

class ViewClient;
class ViewConnection;

/// The bytes of a frame, shared by all clients.
using ViewFrame = std::shared_ptr<const std::string>;

/// State shared by the clients of the live page. Thread: server.
struct ViewServerState {
  static constexpr std::size_t kMaxClients = 64;
  static constexpr std::size_t kMaxUnserved = 32;  ///< connections without a request so far
  static constexpr std::size_t kHistory = 1500;    ///< frames for a new client: one minute
  static constexpr std::size_t kHistoryBytes = 8 << 20;

  std::set<std::shared_ptr<ViewClient>> clients;
  std::list<ViewConnection*> unserved;  ///< oldest first
  std::deque<ViewFrame> history;
  std::size_t history_bytes = 0;
  ViewFrame hello;
  ViewFrame steering_hello;  ///< for clients that have the token
  std::string token;         ///< empty: no client may steer
  std::function<void(const ViewRequest&)> on_request;
  bool loopback_only = true;
  std::size_t most_sockets = kMaxClients + kMaxUnserved;

  /// Adds a frame to the history, within its limits. \param first  clears the history first
  void remember(const ViewFrame& frame, bool first) {
    if (first) {
      history.clear();
      history_bytes = 0;
    }
    history.push_back(frame);
    history_bytes += frame->size();
    while (history.size() > kHistory || (history_bytes > kHistoryBytes && history.size() > 1)) {
      history_bytes -= history.front()->size();
      history.pop_front();
    }
  }
};

}  // namespace merkel
