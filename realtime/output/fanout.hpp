#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <semaphore>
#include <span>
#include <vector>

#include "core/realtime_tag.hpp"
#include "core/records/record_batch.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/sink.hpp"
#include "realtime/clocks/clock.hpp"
#include "realtime/clocks/publish_beat.hpp"
#include "realtime/queues/feed.hpp"

namespace merkel {

/// The feeds of one consumer. A slow or dead consumer loses only its own records.
struct ConsumerChannel {
  explicit ConsumerChannel(const PublishBeat& the_beat) : beat(the_beat) {}

  /// Adds a feed. Call it before the loop starts.
  template <class Record, class... Of>
  Feed<Record>& add(std::size_t capacity, const Of&... of) {
    return *feeds.of<Record>().emplace_back(std::make_unique<Feed<Record>>(capacity, of...));
  }
  /// The first feed of a kind that the consumer takes.
  template <class Record>
  [[nodiscard]] Feed<Record>& feed() noexcept {
    return *feeds.of<Record>().front();
  }
  /// Whether the consumer takes a kind.
  template <class Record>
  [[nodiscard]] bool takes() const noexcept {
    return !feeds.of<Record>().empty();
  }
  /// Records dropped because a feed was full. Thread: any.
  template <class Record>
  [[nodiscard]] std::uint64_t dropped() const noexcept {
    std::uint64_t sum = 0;
    for (const auto& each : feeds.of<Record>()) sum += each->dropped();
    return sum;
  }

  RecordLists<Feeds> feeds;        ///< none of a kind that the consumer does not take
  std::atomic<bool> ended{false};  ///< set after the loop's last record
  std::array<std::atomic<std::uint32_t>, RunControl::kMaxWatched> watched{};  ///< neurons; 0: none
  std::atomic<bool> commands_failed{
      false};                ///< set by the consumer when it can no longer take commands
  Counter commands_refused;  ///< counted by the consumer (StimulationOutlet)
  std::counting_semaphore<> new_commands{0};  ///< released by the gate after each look
  const PublishBeat& beat;                    ///< for waiting until new records are due
};

/// Sends the loop's records to every consumer that takes them.
class Fanout {
 public:
  /// Adds a consumer; call it before the loop starts. The channel lives as long as the fan-out.
  ConsumerChannel& add_channel() {
    return *channels_.emplace_back(std::make_unique<ConsumerChannel>(beat_));
  }
  /// Adds a consumer of spikes.
  ConsumerChannel& add_consumer(std::size_t capacity) {
    ConsumerChannel& channel = add_channel();
    channel.add<SpikeEvent>(capacity);
    return channel;
  }

  /// Publishes records of one kind: of a tick its spikes, then its commands, then its inputs.
  /// Real-time: yes. Thread: simulation.
  template <class Record, Clock C>
  void publish(std::span<const Record> records, C& clock) noexcept MERKEL_REALTIME {
    for (const auto& channel : channels_) {
      for (const auto& feed : channel->feeds.template of<Record>()) {
        for (const Record& record : records) push(*feed, record, clock);
      }
    }
  }

  /// Publishes samples of the neurons that consumers watch. Real-time: yes. Thread: simulation.
  template <Clock C>
  void publish_watched(const TactileModel& model, std::chrono::nanoseconds time,
                       C& clock) noexcept MERKEL_REALTIME {
    for (const auto& channel : channels_) {
      for (const auto& feed : channel->feeds.neurons) {
        for (const auto& watched : channel->watched) {
          const std::uint32_t number = watched.load(std::memory_order_relaxed);
          if (number == 0) continue;
          NeuronSample sample = model.neuron(number);
          sample.time = time;
          push(*feed, sample, clock);
        }
      }
    }
  }

  /// Whether a consumer of commands has failed or lost one. Real-time: yes. Thread: any.
  [[nodiscard]] bool commands_failed() const noexcept MERKEL_REALTIME {
    return std::any_of(channels_.begin(), channels_.end(), [](const auto& channel) {
      return (channel->template takes<StimulationCommand>() ||
              channel->template takes<SentCommand>()) &&
             (channel->commands_failed.load(std::memory_order_relaxed) ||
              channel->template dropped<StimulationCommand>() > 0 ||
              channel->template dropped<SentCommand>() > 0);
    });
  }
  /// Records of a kind dropped because a consumer's feed was full. Thread: any, once the loop runs.
  template <class Record>
  [[nodiscard]] std::uint64_t dropped() const noexcept {
    std::uint64_t sum = 0;
    for (const auto& channel : channels_) sum += channel->dropped<Record>();
    return sum;
  }
  /// Commands that sinks did not pass on. Thread: any, once the loop runs.
  [[nodiscard]] std::uint64_t refused() const noexcept {
    std::uint64_t sum = 0;
    for (const auto& channel : channels_) sum += channel->commands_refused.value();
    return sum;
  }
  /// Announces to every consumer, without waking it, that a tick's spikes are in the queues at
  /// `time`, `after_due` after the tick was due. Real-time: yes. Thread: simulation.
  void published(std::chrono::nanoseconds time,
                 std::chrono::nanoseconds after_due) noexcept MERKEL_REALTIME {
    beat_.published(time, after_due);
  }
  [[nodiscard]] PublishBeat& beat() noexcept { return beat_; }

  /// Marks every channel as ended: no record of the loop will follow. Thread: simulation.
  void end() noexcept {
    for (const auto& channel : channels_) channel->ended.store(true, std::memory_order_release);
  }

 private:
  template <class Record, Clock C>
  static void push(Feed<Record>& feed, const Record& record, C& clock) noexcept {
    bool taken = feed.try_push(record);
    while (!taken && clock.wait_for_others()) taken = feed.try_push(record);
    if (!taken) feed.drop();
  }

  PublishBeat beat_;
  std::vector<std::unique_ptr<ConsumerChannel>> channels_;
};

}  // namespace merkel
