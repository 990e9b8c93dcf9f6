#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <thread>

#include "core/expected.hpp"
#include "drivers/spike_sink.hpp"

namespace merkel {

/// A ZeroMQ subscriber on this host: the zmq: sink that users have, and a thread that receives what
/// it sends and reads the time from the message, as their programs do.
class ZmqLoopback {
 public:
  /// Called in the receiver's thread with each spike's probe time.
  using Receive = std::function<void(std::chrono::nanoseconds spike)>;

  /// Fails where no port can be opened, or where merkel was built without ZeroMQ.
  [[nodiscard]] static Expected<std::unique_ptr<ZmqLoopback>, SetupError> open(
      std::uint32_t neurons, Receive receive);
  ZmqLoopback(const ZmqLoopback&) = delete;
  ZmqLoopback& operator=(const ZmqLoopback&) = delete;
  /// Ends and joins the receiver.
  ~ZmqLoopback();

  /// The sending end, once.
  [[nodiscard]] std::unique_ptr<SpikeSink> sink();
  /// Waits, for a moment at most, until so many spikes have come. Thread: the one that opened.
  void settle(std::uint64_t spikes) const;

 private:
  struct Subscriber;
  ZmqLoopback(std::unique_ptr<Subscriber> subscriber, std::unique_ptr<SpikeSink> sink,
              Receive receive);
  void receive_all(const std::stop_token& stop);

  std::unique_ptr<Subscriber> subscriber_;
  std::unique_ptr<SpikeSink> sink_;
  Receive receive_;
  std::atomic<std::uint64_t> received_{0};
  std::jthread thread_;
};

}  // namespace merkel
