#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <sys/types.h>
#include <zmq.hpp>

#include "core/expected.hpp"
#include "drivers/sink_setup.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// A sink that publishes messages of two parts through a ZeroMQ socket: a type and a topic, then a
/// text.
///
/// The socket is an XPUB, which differs from a PUB for its owner only: it reports who subscribes
/// and when a subscriber's queue is full. Peers are bounded: a subscription is at most 1024 bytes
/// long, and beyond 4096 subscriptions or 64 connections all peers lose their connection. Honest
/// subscribers reconnect by themselves within 100 ms. Thread: consumer, except give_up().
class ZmqPublisher : public Sink {
 public:
  /// Options of the URI: topic, hwm, when_full, subscribers, wait_s, stream.
  struct Options {
    std::string topic;
    int high_water_mark = 0;
    bool wait_when_full = false;
    std::int64_t subscribers = 0;
    std::chrono::milliseconds patience{0};
    std::string stream;  ///< name in the messages, as a JSON string

    [[nodiscard]] static Options read(UriOptions& options, const SinkSetup& setup);
  };

  /// Opens a publisher: binds to the URI's endpoint, or to Publisher::kEndpoint if it has none, and
  /// waits for subscribers.
  template <class Publisher>
  [[nodiscard]] static OpenedSink open(const Uri& uri, const SinkSetup& setup) {
    UriOptions options(uri);
    const Options given = Options::read(options, setup);
    if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
    auto sink = std::make_unique<Publisher>(uri, given, setup);
    if (auto bound = sink->listen(setup, Publisher::kEndpoint); !bound) {
      return Unexpected<SetupError>(bound.error());
    }
    return sink;
  }

  /// Processes subscriptions and connections and limits their numbers.
  [[nodiscard]] Expected<void, SinkError> flush() final {
    return guarded([this] { look_after_peers(); });
  }
  /// Waits until everything is sent, 2 s at most.
  [[nodiscard]] Expected<void, SinkError> close() final;
  void give_up() noexcept final { given_up_.store(true, std::memory_order_relaxed); }

 protected:
  /// \param announced_type  of the message that announce() sets
  ZmqPublisher(Uri uri, const Options& options, std::uint16_t announced_type);

  [[nodiscard]] const std::string& stream() const noexcept { return options_.stream; }
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
  /// ZeroMQ's threads of this publisher, by their numbers in the kernel.
  [[nodiscard]] std::vector<pid_t> threads() const;

 private:
  template <class Action>
  Expected<void, SinkError> guarded(Action action) {
    try {
      action();
    } catch (const zmq::error_t& error) {
      return Unexpected<SinkError>({.sentence = uri_ + " failed: " + error.what() + "; run again"});
    }
    return {};
  }
  Expected<void, SetupError> listen(const SinkSetup& setup, std::string_view fallback);
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

  Uri given_;
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
