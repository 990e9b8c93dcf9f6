#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <sys/types.h>
#include <zmq.hpp>

#include "core/expected.hpp"
#include "drivers/sink_setup.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// A ZeroMQ socket that publishes messages of two parts: a type and a topic, then a text.
///
/// The socket is an XPUB, which differs from a PUB for its owner only: it reports who subscribes
/// and when a subscriber's queue is full. Peers are bounded: a subscription is at most 1024 bytes
/// long, and beyond 4096 subscriptions or 64 connections all peers lose their connection. Honest
/// subscribers reconnect by themselves within 100 ms. Thread: consumer, except give_up().
class ZmqPublisher {
 public:
  /// Options of the URI that every publisher has: topic, hwm, when_full, subscribers, wait_s.
  struct Options {
    std::string topic;
    int high_water_mark = 0;
    bool wait_when_full = false;
    std::int64_t subscribers = 0;
    std::chrono::milliseconds patience{0};

    [[nodiscard]] static Options read(UriOptions& options);
  };

  /// \param announced_type  of the message that announce() sets
  ZmqPublisher(Uri uri, const Options& options, std::uint16_t announced_type);

  /// Binds to the URI's endpoint, or to `fallback` if it has none, and waits for subscribers.
  [[nodiscard]] Expected<void, SetupError> open(const SinkSetup& setup, std::string_view fallback);

  [[nodiscard]] const std::string& uri() const noexcept { return uri_.text; }
  /// The first part of a message: the type's two bytes and the topic.
  [[nodiscard]] std::string head(std::uint16_t type) const;

  /// Sets the text that is sent whenever a subscriber subscribes to the announced type.
  [[nodiscard]] Expected<void, SinkError> announce(std::string text);

  /// Calls `write(send)`; send(head, text) sends a message and returns false if a subscriber with
  /// a full queue lost it.
  template <class Write>
  [[nodiscard]] Expected<void, SinkError> publish(Write write) {
    return guarded([&] {
      look_after_peers();
      write([this](std::string_view head, std::string_view text) { return send(head, text); });
    });
  }
  /// Processes subscriptions and connections and limits their numbers; a few times per second.
  [[nodiscard]] Expected<void, SinkError> flush() {
    return guarded([this] { look_after_peers(); });
  }
  /// Waits until everything is sent, 2 s at most.
  void close();
  /// ZeroMQ's threads of this publisher, by their numbers in the kernel.
  [[nodiscard]] std::vector<pid_t> threads() const;
  /// Ends all waiting. Thread: any.
  void give_up() noexcept { given_up_.store(true, std::memory_order_relaxed); }

 private:
  template <class Action>
  Expected<void, SinkError> guarded(Action action) {
    try {
      action();
    } catch (const zmq::error_t& error) {
      return Unexpected<SinkError>(
          {.sentence = uri_.text + " failed: " + error.what() + "; run again"});
    }
    return {};
  }
  Expected<void, SetupError> bind(std::string_view fallback);
  void open_socket();
  bool wait_for_subscribers();
  void look_after_peers();
  void take_subscription(const zmq::message_t& message);
  void count_connections();
  void close_sockets();
  void drop_all_peers();
  bool send(std::string_view head, std::string_view text);
  bool send_parts(std::string_view head, std::string_view text, zmq::send_flags flags);

  Uri uri_;
  Options options_;
  std::string endpoint_;
  int number_;  ///< among all publishers; the names of ZeroMQ's threads begin with it
  zmq::context_t context_;
  zmq::socket_t socket_;
  zmq::socket_t monitor_;  ///< reports connections
  std::atomic<bool> given_up_{false};
  bool waits_ = false;  ///< for subscribers whose queues are full
  int subscriptions_ = 0;
  int connections_ = 0;
  bool announcement_wanted_ = false;
  std::string announced_head_;
  std::string announced_text_;
};

}  // namespace merkel
