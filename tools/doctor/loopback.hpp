#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <thread>

#include "core/expected.hpp"
#include "drivers/sink.hpp"

namespace merkel {

/// A ZeroMQ subscriber on this host: the ordinary zmq: sink, and a thread that receives its
/// messages and reads the time from them, as users' programs do. In programs that were built with
/// ZeroMQ.
class Loopback {
 public:
  /// Called in the receiver's thread with each spike's probe time.
  using Receive = std::function<void(std::chrono::nanoseconds spike)>;

  /// Null without ZeroMQ. Fails if no port can be opened.
  [[nodiscard]] static Expected<std::unique_ptr<Loopback>, SetupError> open(std::uint32_t neurons,
                                                                            Receive receive);
  Loopback(const Loopback&) = delete;
  Loopback& operator=(const Loopback&) = delete;
  /// Ends and joins the receiver.
  ~Loopback();

  /// The sending end; call once.
  [[nodiscard]] std::unique_ptr<Sink> sink();
  /// Waits, for a short time at most, until `spikes` spikes have arrived. Thread: the opener's.
  void settle(std::uint64_t spikes) const;

 private:
  struct Subscriber;
  Loopback(std::unique_ptr<Subscriber> subscriber, std::unique_ptr<Sink> sink, Receive receive);
  void receive_all(const std::stop_token& stop);

  std::unique_ptr<Subscriber> subscriber_;
  std::unique_ptr<Sink> sink_;
  Receive receive_;
  std::atomic<std::uint64_t> received_{0};
  std::jthread thread_;
};

}  // namespace merkel
