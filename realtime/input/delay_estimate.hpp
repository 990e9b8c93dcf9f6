#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/realtime_tag.hpp"
#include "core/records/probe_sample.hpp"
#include "drivers/probe.hpp"
#include "realtime/queues/latency_histogram.hpp"

namespace merkel {

/// How long the loop must wait for the samples of one device, measured over the last seconds.
///
/// A tick between two samples needs the second one, so it needs the time from its end to that
/// sample's arrival; without interpolation, to the arrival of the sample before it. The estimate is
/// the quantile of these needs over a sliding window of eight slots. It knows the grid of the
/// ticks: where a device keeps its place between two ticks, no tick waits longer than that place
/// requires. A host that stalled delays every arrival: the time of such a stall is not charged to
/// the device. Silences of more than four periods are outages and do not count. Real-time: yes,
/// after construction. Thread: simulation.
class DelayEstimate {
 public:
  using Time = std::chrono::nanoseconds;
  static constexpr Time kSlot{500'000'000};
  static constexpr std::size_t kSlots = 8;

  struct Parameters {
    bool interpolate = true;
    double held_share = 0.001;      ///< share of the needs that may exceed the estimate
    std::optional<Time> max_delay;  ///< default: SampleTiming::delay_ceiling()
  };

  explicit DelayEstimate(const Parameters& parameters)
      : parameters_(parameters), slots_(kSlots * kBuckets), sum_(kBuckets) {}

  /// The ticks whose samples are awaited: one ends every `tick` from `start` on. Without them, a
  /// tick may end at any time. Call it before the first sample.
  void set_ticks(Time start, Time tick) noexcept {
    start_ = start;
    tick_ = tick;
  }

  /// The host, or one of its cores, did not run between two instants of its clock.
  void add_stall(Time begin, Time end) noexcept MERKEL_REALTIME {
    // Several cores and the loop may report the same stall.
    for (Stall& stall : stalls_) {
      if (begin > stall.end || end < stall.begin) continue;
      stall = {.begin = std::min(begin, stall.begin), .end = std::max(end, stall.end)};
      return;
    }
    stalls_[next_stall_++ % stalls_.size()] = {.begin = begin, .end = end};
  }

  /// Adds the next sample, in order of time.
  void add(const ProbeSample& sample) noexcept MERKEL_REALTIME {
    if (last_) {
      const Time interval = sample.time - *last_;
      const bool outage = period_.count() > 0 && interval > kOutage * period_;
      const bool opening = sample.arrival < first_arrival_ + kOpening;
      if (interval.count() > 0) follow_period(outage ? kOutage * period_ : interval);
      if (!outage && !opening && interval.count() > 0) {
        if (waiting_ == recent_.size()) count_oldest();
        recent_[(oldest_ + waiting_++) % recent_.size()] = {sample.time, sample.arrival, interval};
      }
    } else {
      first_arrival_ = sample.arrival;
    }
    last_ = sample.time;
    while (waiting_ > 0 && sample.arrival - recent_[oldest_].arrival >= kSettle) {
      count_oldest();
    }
  }

  /// The smallest delay that holds at most the share of the ticks; none before enough samples.
  [[nodiscard]] std::optional<Time> needed() const noexcept MERKEL_REALTIME {
    if (samples_ < kMin) return std::nullopt;
    const auto allowed =
        static_cast<std::uint64_t>(parameters_.held_share * static_cast<double>(samples_));
    std::uint64_t above = 0;
    for (std::size_t bucket = kBuckets; bucket-- > 0;) {
      above += sum_[bucket];
      if (above > allowed) {
        return Time{static_cast<std::int64_t>(LatencyHistogram::highest_of(bucket))} + kMargin;
      }
    }
    return kMargin;
  }

  /// The longest delay that the loop accepts.
  [[nodiscard]] Time ceiling() const noexcept MERKEL_REALTIME {
    return parameters_.max_delay.value_or(SampleTiming::delay_ceiling(period_));
  }

 private:
  static constexpr std::size_t kBuckets = LatencyHistogram::kBuckets;
  static constexpr std::uint64_t kMin = 4;
  static constexpr int kOutage = 4;  ///< periods without a sample
  /// While a device is opened, its first samples wait for their reader.
  static constexpr Time kOpening{100'000'000};
  static constexpr Time kMargin{20'000};

  struct Stall {
    Time begin{0};
    Time end{0};
  };

  /// The times of a sample, and the interval to the one before.
  struct Arrival {
    Time time{0};
    Time arrival{0};
    Time interval{0};
  };

  void count_oldest() noexcept {
    count(recent_[oldest_]);
    oldest_ = (oldest_ + 1) % recent_.size();
    --waiting_;
  }

  /// The part of a sample's way to the host during which the host stalled.
  [[nodiscard]] Time stalled(const Arrival& sample) const noexcept {
    Time sum{0};
    for (const Stall& stall : stalls_) {
      // After a stall the readers need some time for their backlog.
      const bool concerned =
          sample.arrival >= stall.begin && sample.arrival <= stall.end + (stall.end - stall.begin);
      if (!concerned) continue;
      const Time begin = std::max(stall.begin, sample.time);
      sum += std::max(std::min(sample.arrival, stall.end) - begin, Time{0});
    }
    return sum;
  }

  /// The first end of a tick from a time on, or shortly before: a device that drifts will soon be
  /// there.
  [[nodiscard]] Time tick_from(Time time) const noexcept {
    if (tick_.count() == 0) return time;
    const Time since = time - tick_ / kGuard - start_;
    return time - tick_ / kGuard + (tick_ - since % tick_) % tick_;
  }

  /// An outage counts in part, so that samples that were very close for a while do not make all
  /// later intervals outages.
  void follow_period(Time interval) noexcept {
    const Time change = interval - period_;
    period_ += period_.count() == 0 ? interval : change / kPeriodMemory;
    period_ = std::max(period_, kMinPeriod);
  }

  void count(const Arrival& sample) noexcept {
    const Time interval = sample.interval;
    while (sample.arrival >= slot_end_) turn(sample.arrival);
    const Time tick_end = tick_from(parameters_.interpolate ? sample.time - interval : sample.time);
    // Of several samples in a tick, only one is awaited.
    const Time ahead = sample.time - tick_end;
    if (parameters_.interpolate ? ahead < Time{0} : -ahead > period_) return;
    const Time least = parameters_.interpolate ? ahead : Time{0};
    const Time need = sample.arrival - stalled(sample) - tick_end;
    const auto bucket =
        LatencyHistogram::bucket_of(static_cast<std::uint64_t>(std::max(need, least).count()));
    ++slots_[slot_ * kBuckets + bucket];
    ++sum_[bucket];
    ++samples_;
  }

  /// Begins the next slot and forgets the oldest one.
  void turn(Time now) noexcept {
    if (slot_end_.count() == 0 || now - slot_end_ > kSlot * kSlots) slot_end_ = now;
    slot_end_ += kSlot;
    slot_ = (slot_ + 1) % kSlots;
    for (std::size_t bucket = 0; bucket < kBuckets; ++bucket) {
      std::uint32_t& old = slots_[slot_ * kBuckets + bucket];
      sum_[bucket] -= old;
      samples_ -= old;
      old = 0;
    }
  }

  /// A stall is reported after its end, when samples that waited for it may have arrived before.
  static constexpr Time kSettle{20'000'000};
  static constexpr std::size_t kMaxWaiting = 256;
  static constexpr int kPeriodMemory = 16;  ///< samples
  static constexpr Time kMinPeriod{1'000};
  static constexpr int kGuard = 20;  ///< of these in a tick

  Parameters parameters_;
  std::vector<std::uint32_t> slots_;  ///< the needs of each slot, by bucket
  std::vector<std::uint32_t> sum_;    ///< of all slots
  std::size_t slot_ = 0;
  std::uint64_t samples_ = 0;
  Time slot_end_{0};
  Time period_{0};
  Time start_{0};
  Time tick_{0};  ///< 0: at any time
  std::optional<Time> last_;
  Time first_arrival_{0};
  std::array<Arrival, kMaxWaiting> recent_{};  ///< a ring of samples that are not counted yet
  std::size_t oldest_ = 0;
  std::size_t waiting_ = 0;
  std::array<Stall, 16> stalls_{};
  std::size_t next_stall_ = 0;
};

}  // namespace merkel
