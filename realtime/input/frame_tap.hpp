#pragma once

#include <cstdint>

#include "core/records/record_batch.hpp"
#include "drivers/probe.hpp"
#include "realtime/queues/feed.hpp"

namespace merkel {

/// Passes the bytes of one port of a probe to a feed, from the port's reader thread. It listens
/// until end() or its destruction.
class FrameTap final : public PortListener {
 public:
  static constexpr std::size_t kCapacity = 16384;  ///< of the feed

  /// \param number  of the probe, from 0
  /// \param port    of the probe, from 0
  FrameTap(Probe& probe, std::uint32_t number, std::uint32_t port, Feed<PortFrame>& feed)
      : probe_(probe), number_(number), port_(port), feed_(feed) {
    probe_.add_listener(port_, *this);
  }
  ~FrameTap() override { end(); }

  void take(const RawFrame& frame) noexcept override {
    if (!feed_.try_push({.probe = number_, .port = port_, .frame = frame})) feed_.drop();
  }
  void missed(std::uint64_t frames) noexcept override { feed_.drop(frames); }

  /// Stops listening. Thread: any but the port's.
  void end() {
    probe_.remove_listener(port_, *this);
    feed_.end();
  }

 private:
  Probe& probe_;
  std::uint32_t number_;
  std::uint32_t port_;
  Feed<PortFrame>& feed_;
};

}  // namespace merkel
