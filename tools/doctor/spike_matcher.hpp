#pragma once

#include <chrono>
#include <cstdint>
#include <deque>

#include "realtime/loop/tick_timing.hpp"
#include "realtime/queues/latency_histogram.hpp"

namespace merkel {

/// The time at which a consumer received a spike.
struct SpikeArrival {
  std::chrono::nanoseconds spike{0};    ///< its probe time
  std::chrono::nanoseconds arrival{0};  ///< host-monotonic
};

/// Finds the tick of each spike that reached a consumer, and measures the latency of each stage.
/// Ticks and spikes are added in order of time, in pieces of any size.
class SpikeMatcher {
 public:
  explicit SpikeMatcher(std::chrono::nanoseconds tick) : tick_(tick) {}

  void add(const TickTiming& timing) { timings_.push_back(timing); }
  void add(const SpikeArrival& arrival) { arrivals_.push_back(arrival); }
  /// Matches as many spikes as possible; the others wait for ticks that have not been added yet.
  void match();

  /// From the consumer's queue to the consumer.
  [[nodiscard]] LatencySummary sink() const { return LatencySummary::of(sink_.snapshot()); }
  /// From the due time of the tick to the consumer: the latency that software adds to the jitter
  /// buffer and the tick.
  [[nodiscard]] LatencySummary software() const { return LatencySummary::of(software_.snapshot()); }
  /// From the arrival of the last sample at or before the tick's end.
  [[nodiscard]] LatencySummary sample_to_received() const {
    return LatencySummary::of(sample_to_received_.snapshot());
  }
  /// Spikes without a known tick.
  [[nodiscard]] std::uint64_t unmatched() const noexcept { return unmatched_ + arrivals_.size(); }

 private:
  std::chrono::nanoseconds tick_;
  std::deque<TickTiming> timings_;
  std::deque<SpikeArrival> arrivals_;
  LatencyHistogram sink_;
  LatencyHistogram software_;
  LatencyHistogram sample_to_received_;
  std::uint64_t unmatched_ = 0;
};

}  // namespace merkel
