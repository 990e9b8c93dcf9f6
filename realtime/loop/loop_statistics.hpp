#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "core/records/run_counters.hpp"
#include "realtime/queues/counter.hpp"
#include "realtime/queues/latency_histogram.hpp"

namespace merkel {

/// The counters and latencies of a run so far. The simulation thread updates them; any thread reads
/// them.
struct LoopStatistics : RunCountersOf<Counter> {
  /// The counters as plain numbers. Thread: any.
  [[nodiscard]] RunCounters snapshot() const noexcept {
    RunCounters counters;
    for (std::size_t i = 0; i < kRunCounterFields<>.size(); ++i) {
      counters.*kRunCounterFields<>[i].cell = (this->*kRunCounterFields<Counter>[i].cell).value();
    }
    return counters;
  }

  /// By how much the loop is late while it catches up with the first samples of its devices; else
  /// 0.
  std::atomic<std::int64_t> behind_at_start_ns{0};

  /// From the arrival of the last sample before a tick's end to the publication of its spikes;
  /// only ticks with spikes.
  LatencyHistogram sample_to_spike;
  /// The same to the publication of its commands; only ticks with commands.
  LatencyHistogram sample_to_command;
  /// The stages between a sample and its spikes: its latency is the wait for the tick's end, the
  /// delay, the wake-up, the tick and the publication, less its way to the host.
  LatencyHistogram way;       ///< from the time of a sample to its arrival
  LatencyHistogram tick_end;  ///< from the time of a sample to the end of its tick
  LatencyHistogram delay;     ///< of the loop at every tick that was on time
  LatencyHistogram
      wake_up;  ///< from the time a tick was due to its beginning; only ticks that waited
  LatencyHistogram queue;  ///< from the sample's arrival to the tick's beginning: the jitter buffer
  LatencyHistogram tick;   ///< from the tick's beginning to the end of the model's step
  LatencyHistogram processor;  ///< processor time of a tick, its publication included
  LatencyHistogram publish;    ///< from there until its spikes are in the consumers' queues
};

/// Where the latencies from a sample stood five to ten seconds ago. Thread: one.
class RecentLatency {
 public:
  struct Moment {
    LatencyHistogram::Snapshot spike;
    LatencyHistogram::Snapshot command;
  };

  /// Call it several times a second. \param now  of the host's clock
  void look(const LoopStatistics& statistics, std::chrono::nanoseconds now) {
    if (now - looked_ < kEvery) return;
    looked_ = now;
    before_ = std::exchange(later_, {.spike = statistics.sample_to_spike.snapshot(),
                                     .command = statistics.sample_to_command.snapshot()});
  }
  [[nodiscard]] const Moment& before() const noexcept { return before_; }

 private:
  static constexpr std::chrono::seconds kEvery{5};

  Moment before_;
  Moment later_;
  std::chrono::nanoseconds looked_{0};
};

}  // namespace merkel
