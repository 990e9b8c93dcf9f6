#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "core/realtime_tag.hpp"
#include "core/records/loop_event.hpp"
#include "core/records/run_counters.hpp"
#include "core/records/spike_event.hpp"
#include "core/records/stimulation_command.hpp"
#include "core/records/tick_record.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/spike_sink.hpp"
#include "realtime/clocks/clock.hpp"
#include "realtime/clocks/publish_beat.hpp"
#include "realtime/queues/counted_queue.hpp"

namespace merkel {

/// The neurons that one consumer watches, and their samples.
struct WatchedNeurons {
  WatchedNeurons() : samples(kCapacity) {}

  static constexpr std::size_t kCapacity = 16384;
  std::array<std::atomic<std::uint32_t>, RunControl::kMostWatched> neurons{};  ///< 0: none
  CountedQueue<NeuronSample> samples;
};

/// The queues of one consumer. A slow or dead consumer loses only its own items.
struct SpikeChannel {
  SpikeChannel(std::size_t capacity, const PublishBeat& the_beat)
      : spikes(capacity), beat(the_beat) {}

  BoundedQueue<SpikeEvent> spikes;  ///< simulation thread → consumer
  Counter dropped;                  ///< spikes dropped because the queue was full
  std::atomic<bool> ended{false};   ///< set after the last item of the run
  /// Optional items; null if the consumer did not request them.
  std::unique_ptr<CountedQueue<TickRecord>> ticks;
  std::unique_ptr<CountedQueue<LoopEvent>> events;
  std::unique_ptr<WatchedNeurons> watched;
  std::unique_ptr<CountedQueue<StimulationCommand>> commands;
  std::atomic<bool> commands_failed{
      false};                ///< set by the consumer when it can no longer take commands
  bool takes_spikes = true;  ///< set before the loop starts
  /// Counted by the consumer: what its gate did with commands (StimulationGate::Counts).
  Counter commands_withheld;
  Counter commands_slowed;
  Counter stale_stops;
  const PublishBeat& beat;  ///< for waiting until new items are due
};

/// Sends every spike to every consumer.
class SpikeFanout {
 public:
  /// Adds a consumer; call it before the loop starts. The channel lives as long as the fan-out.
  SpikeChannel& add_consumer(std::size_t capacity) {
    return *channels_.emplace_back(std::make_unique<SpikeChannel>(capacity, beat_));
  }

  /// Real-time: yes. Thread: simulation.
  template <Clock C>
  void publish(std::span<const SpikeEvent> spikes, C& clock) noexcept MERKEL_REALTIME {
    for (const auto& channel : channels_) {
      if (!channel->takes_spikes) continue;
      for (const SpikeEvent& spike : spikes) {
        push(channel->spikes, channel->dropped, spike, clock);
      }
    }
  }

  /// Publishes the commands of a tick, after its spikes. Real-time: yes. Thread: simulation.
  template <Clock C>
  void publish(std::span<const StimulationCommand> commands, C& clock) noexcept MERKEL_REALTIME {
    for (const auto& channel : channels_) {
      if (!channel->commands) continue;
      for (const StimulationCommand& command : commands) {
        push(channel->commands->items, channel->commands->dropped, command, clock);
      }
    }
  }
  /// Whether a consumer of commands has failed or lost one. Real-time: yes. Thread: any.
  [[nodiscard]] bool commands_failed() const noexcept MERKEL_REALTIME {
    return std::any_of(channels_.begin(), channels_.end(), [](const auto& channel) {
      return channel->commands && (channel->commands_failed.load(std::memory_order_relaxed) ||
                                   channel->commands->dropped.value() > 0);
    });
  }

  /// Publishes the records of a tick, after its spikes and commands. Real-time: yes. Thread:
  /// simulation.
  template <Clock C>
  void publish(std::span<const TickRecord> ticks, C& clock) noexcept MERKEL_REALTIME {
    for (const auto& channel : channels_) {
      if (!channel->ticks) continue;
      for (const TickRecord& tick : ticks) {
        push(channel->ticks->items, channel->ticks->dropped, tick, clock);
      }
    }
  }

  /// Real-time: yes. Thread: simulation.
  template <Clock C>
  void publish(const LoopEvent& event, C& clock) noexcept MERKEL_REALTIME {
    for (const auto& channel : channels_) {
      if (channel->events) push(channel->events->items, channel->events->dropped, event, clock);
    }
  }

  /// Publishes samples of the neurons that consumers watch. Real-time: yes. Thread: simulation.
  template <Clock C>
  void publish_watched(const TactileModel& model, std::chrono::nanoseconds time,
                       C& clock) noexcept MERKEL_REALTIME {
    for (const auto& channel : channels_) {
      if (!channel->watched) continue;
      for (const auto& watched : channel->watched->neurons) {
        const std::uint32_t number = watched.load(std::memory_order_relaxed);
        if (number == 0) continue;
        NeuronSample sample = model.neuron(number);
        sample.time = time;
        push(channel->watched->samples.items, channel->watched->samples.dropped, sample, clock);
      }
    }
  }

  /// Spikes dropped because a consumer's queue was full. Thread: any, once the loop runs.
  [[nodiscard]] std::uint64_t dropped() const noexcept {
    std::uint64_t sum = 0;
    for (const auto& channel : channels_) sum += channel->dropped.value();
    return sum;
  }
  /// Commands dropped because a consumer's queue was full. Thread: any, once the loop runs.
  [[nodiscard]] std::uint64_t commands_dropped() const noexcept {
    std::uint64_t sum = 0;
    for (const auto& channel : channels_) {
      if (channel->commands) sum += channel->commands->dropped.value();
    }
    return sum;
  }
  /// Adds what the gates of all consumers did with commands. Thread: any, once the loop runs.
  void add_gates_to(RunCounters& counters) const {
    for (const auto& channel : channels_) {
      counters.commands_withheld += channel->commands_withheld.value();
      counters.commands_slowed += channel->commands_slowed.value();
      counters.stale_stops += channel->stale_stops.value();
    }
  }
  /// Announces to every consumer, without waking it, that a tick's spikes are in the queues at
  /// `time`, `after_due` after the tick was due. Real-time: yes. Thread: simulation.
  void published(std::chrono::nanoseconds time,
                 std::chrono::nanoseconds after_due) noexcept MERKEL_REALTIME {
    beat_.published(time, after_due);
  }
  [[nodiscard]] PublishBeat& beat() noexcept { return beat_; }

  /// Marks every channel as ended: no spike will follow. Thread: simulation.
  void end() noexcept {
    for (const auto& channel : channels_) channel->ended.store(true, std::memory_order_release);
  }

 private:
  template <PlainData T, Clock C>
  static void push(BoundedQueue<T>& queue, Counter& dropped, const T& item, C& clock) noexcept {
    bool taken = queue.try_push(item);
    while (!taken && clock.wait_for_others()) taken = queue.try_push(item);
    if (!taken) dropped.add();
  }

  PublishBeat beat_;
  std::vector<std::unique_ptr<SpikeChannel>> channels_;
};

}  // namespace merkel
