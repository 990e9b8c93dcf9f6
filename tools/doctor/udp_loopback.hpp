#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <thread>

#include "core/expected.hpp"
#include "drivers/sink.hpp"

namespace merkel {

/// A consumer behind a UDP socket on this host: a sink that sends, and a thread that receives.
class UdpLoopback {
 public:
  /// Called in the receiver's thread with each spike's probe time.
  using Receive = std::function<void(std::chrono::nanoseconds spike)>;

  /// Fails if the host has no loopback interface.
  [[nodiscard]] static Expected<std::unique_ptr<UdpLoopback>, SetupError> open(Receive receive);
  UdpLoopback(const UdpLoopback&) = delete;
  UdpLoopback& operator=(const UdpLoopback&) = delete;
  /// Ends and joins the receiver.
  ~UdpLoopback();

  /// The sending end; must not outlive this object.
  [[nodiscard]] std::unique_ptr<Sink> sink();
  /// Waits, for a short time at most, until everything sent has arrived. Thread: the opener's.
  void settle() const;
  [[nodiscard]] std::uint64_t sent() const noexcept { return sent_.load(); }
  [[nodiscard]] std::uint64_t received() const noexcept { return received_.load(); }

 private:
  class CountingSink;
  UdpLoopback(int sender, int receiver, Receive receive);
  void receive_all(const std::stop_token& stop);

  int sender_;
  int receiver_;
  Receive receive_;
  std::atomic<std::uint64_t> sent_{0};
  std::atomic<std::uint64_t> received_{0};
  std::jthread thread_;
};

}  // namespace merkel
