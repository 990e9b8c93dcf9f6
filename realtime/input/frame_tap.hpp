#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "core/records/record_batch.hpp"
#include "drivers/probe.hpp"
#include "realtime/queues/counted_queue.hpp"

namespace merkel {

/// The queue through which a sink receives the bytes of one port of a probe. It listens until end()
/// or its destruction.
class FrameTap final : public PortListener {
 public:
  /// \param number  of the probe, from 0
  /// \param port    of the probe, from 0
  FrameTap(Probe& probe, std::uint32_t number, std::uint32_t port, std::size_t capacity = 16384)
      : queue(capacity), probe_(probe), number_(number), port_(port) {
    probe_.add_listener(port_, *this);
  }
  ~FrameTap() override { end(); }

  void take(const RawFrame& frame) noexcept override {
    if (!queue.items.try_push({.probe = number_, .port = port_, .frame = frame}))
      queue.dropped.add();
  }
  void missed(std::uint64_t frames) noexcept override { queue.dropped.add(frames); }

  /// Stops listening. Thread: any but the port's.
  void end() {
    probe_.remove_listener(port_, *this);
    ended.store(true, std::memory_order_release);
  }

  CountedQueue<PortFrame> queue;   ///< the port's reader thread → consumer
  std::atomic<bool> ended{false};  ///< set after the last frame

 private:
  Probe& probe_;
  std::uint32_t number_;
  std::uint32_t port_;
};

}  // namespace merkel
