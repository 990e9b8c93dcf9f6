#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "core/realtime_tag.hpp"
#include "core/spike_event.hpp"
#include "realtime/bounded_queue.hpp"
#include "realtime/clock.hpp"
#include "realtime/counter.hpp"
#include "realtime/publish_beat.hpp"

namespace merkel {

/// The queue of one consumer of spikes, with its own count of drops. A slow or dead consumer costs
/// its own spikes and nobody else's.
struct SpikeChannel {
  SpikeChannel(std::size_t capacity, const PublishBeat& the_beat)
      : spikes(capacity), beat(the_beat) {}

  BoundedQueue<SpikeEvent> spikes;  ///< simulation thread → consumer
  Counter dropped;                  ///< spikes that found the queue full
  std::atomic<bool> ended{false};   ///< set after the last spike of the run
  const PublishBeat& beat;          ///< for waiting until there may be more
};

/// Gives every spike to every consumer.
class SpikeFanout {
 public:
  /// Adds a consumer; before the loop starts. The channel lives as long as the fan-out.
  SpikeChannel& add_consumer(std::size_t capacity) {
    return *channels_.emplace_back(std::make_unique<SpikeChannel>(capacity, beat_));
  }

  /// Real-time: yes. Thread: simulation.
  template <Clock C>
  void publish(std::span<const SpikeEvent> spikes, C& clock) noexcept MERKEL_REALTIME {
    for (const auto& channel : channels_) {
      for (const SpikeEvent& spike : spikes) {
        bool taken = channel->spikes.try_push(spike);
        while (!taken && clock.wait_for_others()) taken = channel->spikes.try_push(spike);
        if (!taken) channel->dropped.add();
      }
    }
  }

  /// Tells every consumer, without waking it, that a tick's spikes are there: so long after the
  /// tick was due. Real-time: yes. Thread: simulation.
  void published(std::chrono::nanoseconds after_due) noexcept MERKEL_REALTIME {
    beat_.published(after_due);
  }
  [[nodiscard]] PublishBeat& beat() noexcept { return beat_; }

  /// Tells every consumer that no spike will follow. Thread: simulation.
  void end() noexcept {
    for (const auto& channel : channels_) channel->ended.store(true, std::memory_order_release);
  }

 private:
  PublishBeat beat_;
  std::vector<std::unique_ptr<SpikeChannel>> channels_;
};

}  // namespace merkel
