#pragma once

#include <cstdint>

#include "core/realtime_tag.hpp"
#include "core/records/spike_event.hpp"

namespace merkel {

struct ConsumerChannel;

/// Receives the spikes of a run by polling. Borrowed from a Pipeline, valid as long as it.
/// Thread: one, of the program's own.
class SpikeConsumer {
 public:
  explicit SpikeConsumer(ConsumerChannel& channel) noexcept : channel_(&channel) {}

  /// Takes the oldest waiting spike, in order of time; false if none waits. Real-time: yes.
  [[nodiscard]] bool try_pop(SpikeEvent& spike) noexcept MERKEL_REALTIME;
  /// Whether the run has ended: no spike will follow those that wait. Ask before the last look
  /// into the queue. Real-time: yes.
  [[nodiscard]] bool ended() const noexcept MERKEL_REALTIME;
  /// Spikes dropped because the queue was full. Thread: any.
  [[nodiscard]] std::uint64_t dropped() const noexcept MERKEL_REALTIME;
  /// Waits until the spikes of the next tick are due, at most about 5 ms. Real-time: no.
  void wait() noexcept;

 private:
  ConsumerChannel* channel_;
  std::uint64_t seen_ = 0;  ///< ticks
};

}  // namespace merkel
