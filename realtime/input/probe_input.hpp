#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/realtime_tag.hpp"
#include "core/records/contact_input.hpp"
#include "core/records/probe_sample.hpp"
#include "core/records/tick_record.hpp"
#include "realtime/input/contact_decision.hpp"
#include "realtime/input/delay_estimate.hpp"
#include "realtime/input/tick_mean.hpp"

namespace merkel {

struct ProbeQueue;
struct ReadingHead;

/// Converts one probe's samples into its contact at increasing times.
///
/// Between two samples, the contact is their linear interpolation (or the first of them). If
/// several samples lie between two times, it may be the mean of all of these (Decimate). Before the
/// first sample, the first sample applies. Every sample has a period of validity. If no other
/// sample follows within it, the probe is released (depth and force 0) until the next sample's
/// time; without such a period, after 50 ms of readings in which it has no value. If no sample
/// beyond the requested time has arrived yet, the last one is held. The rule depends only on the
/// samples, so a recording gives the same result as the live run whenever nothing was late. Of a
/// probe with a threshold of contact, a sample that does not touch has a depth and force of 0 or
/// less. Real-time: yes.
class ProbeInput {
 public:
  /// The contact of a tick in which several samples lie: by the last of them, or their mean.
  enum class Decimate : std::uint8_t { kLast, kMean };
  struct Parameters {
    /// Overrides ProbeSample::valid_for of the samples; 0: never released.
    std::optional<std::chrono::nanoseconds> stale_after;
    /// Whether to interpolate linearly between two samples; if not, the first of them is held.
    bool interpolate = true;
    Decimate decimate = Decimate::kLast;
    double held_share = 0.001;  ///< share of the ticks that the delay of the loop may hold
    std::optional<std::chrono::nanoseconds> max_delay;  ///< default: SampleTiming::delay_ceiling()
    /// Position of the probe if its samples have no position.
    double x_mm = 15.0;
    double y_mm = 10.0;
    ContactDecision::Parameters contact;
  };
  using State = TickRecord::State;
  struct Reading {
    ContactInput contact;
    State state = State::kFollowing;
    std::uint8_t doubts = 0;     ///< of the samples that it rests on: ProbeSample::Doubt bits
    Touch touch = Touch::kFree;  ///< of the samples that have a share in it
  };
  struct Counts {
    std::uint64_t used = 0;            ///< samples that had arrived when their time was simulated
    std::uint64_t late = 0;            ///< samples whose time had already been simulated
    std::uint64_t held_ticks = 0;      ///< readings in state kHeld
    std::uint64_t released_ticks = 0;  ///< readings in state kReleased
  };

  ProbeInput(ProbeQueue& channel, const Parameters& parameters);

  /// Measures from now on how long the loop must wait for the samples. Real-time: no.
  void measure_delay() {
    estimate_.emplace(DelayEstimate::Parameters{.interpolate = parameters_.interpolate,
                                                .held_share = parameters_.held_share,
                                                .max_delay = parameters_.max_delay});
  }
  /// Null if the delay is not measured. Real-time: yes.
  [[nodiscard]] DelayEstimate* estimate() noexcept MERKEL_REALTIME {
    return estimate_ ? &*estimate_ : nullptr;
  }

  /// Whether all samples needed for `time` have arrived: one beyond it, or the end of the stream.
  [[nodiscard]] bool ready_for(std::chrono::nanoseconds time) noexcept MERKEL_REALTIME;

  /// The contact at `time`, which must be later than in the previous call.
  [[nodiscard]] Reading at(std::chrono::nanoseconds time) noexcept MERKEL_REALTIME;

  /// The pressures of a tactile array at the time of the last reading, kPa, by the same rule as the
  /// contact; empty for other probes.
  [[nodiscard]] std::span<const float> taxels() const noexcept MERKEL_REALTIME { return taxels_; }

  /// Whether every sample of an ended stream has been used.
  [[nodiscard]] bool exhausted() const noexcept MERKEL_REALTIME;

  /// Time of the oldest waiting sample, if any.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> first_time() const noexcept;
  /// Time of the last sample used, if any.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> last_time() const noexcept {
    return last_ ? std::optional(last_->time) : std::nullopt;
  }
  /// Arrival of the last sample used, if any: host-monotonic for a device.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> last_arrival() const noexcept {
    return last_ ? std::optional(last_->arrival) : std::nullopt;
  }
  /// Thread: any.
  [[nodiscard]] Counts counts() const noexcept;

 private:
  [[nodiscard]] Reading reading_at(std::chrono::nanoseconds time) noexcept;
  /// \return the first sample beyond `time`, or null. To ask the queue again may find a sample that
  /// has arrived since, of any time.
  const ReadingHead* consume_until(std::chrono::nanoseconds time) noexcept;
  [[nodiscard]] ContactInput contact_of(const ProbeSample& sample) const noexcept;
  [[nodiscard]] std::chrono::nanoseconds valid_for_last() const noexcept;
  [[nodiscard]] bool is_out(const ProbeSample& sample) const noexcept;
  [[nodiscard]] Touch touch_of(const ContactInput& contact) const noexcept;
  [[nodiscard]] bool uses_mean() const noexcept;
  void blend_taxels() noexcept;
  [[nodiscard]] ContactInput released(const ContactInput& last) const noexcept;

  ProbeQueue& channel_;
  Parameters parameters_;
  std::optional<DelayEstimate> estimate_;
  std::optional<ProbeSample> last_;  ///< the latest sample at or before the time read last
  std::vector<float> last_taxels_;   ///< of that sample
  std::vector<float> taxels_;
  /// The shares of the last sample and of the next one in the reading.
  float last_share_ = 0.0F;
  float next_share_ = 0.0F;
  TickMean mean_;  ///< of the samples since the time read last
  std::optional<std::chrono::nanoseconds> touch_began_;  ///< the present touch
  std::chrono::nanoseconds simulated_ = std::chrono::nanoseconds::min();
};

/// One of the probes that a device feeds.
struct RunInput {
  std::size_t probe = 0;  ///< its number in the run, from 0: the number of its indenter
  ProbeInput::Parameters parameters;
};

}  // namespace merkel
