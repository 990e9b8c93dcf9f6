#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "core/realtime_tag.hpp"
#include "core/records/contact_input.hpp"
#include "core/records/probe_sample.hpp"
#include "core/records/tick_record.hpp"
#include "realtime/input/probe_channel.hpp"

namespace merkel {

/// Turns one probe's samples into its contact at any time, which only goes forward.
///
/// Between two samples the contact is their linear interpolation (or the newest sample); before the
/// first sample it is the first. Every sample says for how long it is valid: it holds for so long
/// where none follows, then the probe is released (depth and force 0) until the next sample's time.
/// Where no sample beyond the requested time has arrived yet, the last one holds too. The rule
/// depends on the samples alone, so a recording gives what the live run gave whenever nothing was
/// late. Real-time: yes.
class ProbeInput {
 public:
  struct Parameters {
    /// Replaces what the samples say (ProbeSample::valid_for); 0: never released.
    std::optional<std::chrono::nanoseconds> stale_after;
    /// Between two samples: their linear interpolation, or else the first of them.
    bool interpolate = true;
    /// Where the probe presses if its samples do not say.
    double x_mm = 15.0;
    double y_mm = 10.0;
  };
  using State = TickRecord::State;
  struct Reading {
    ContactInput contact;
    State state = State::kFollowing;
  };
  struct Counts {
    std::uint64_t used = 0;            ///< samples that were there when their time came
    std::uint64_t late = 0;            ///< samples whose time had already been simulated
    std::uint64_t held_ticks = 0;      ///< readings in state kHeld
    std::uint64_t released_ticks = 0;  ///< readings in state kReleased
  };

  ProbeInput(ProbeChannel& channel, const Parameters& parameters) noexcept
      : channel_(channel), parameters_(parameters) {}

  /// Whether all samples needed for `time` are there: one beyond it, or the end of the stream.
  [[nodiscard]] bool ready_for(std::chrono::nanoseconds time) noexcept MERKEL_REALTIME;

  /// The contact at `time`, which is later than at the call before.
  [[nodiscard]] Reading at(std::chrono::nanoseconds time) noexcept MERKEL_REALTIME;

  /// Whether every sample of an ended stream has been used.
  [[nodiscard]] bool exhausted() const noexcept MERKEL_REALTIME;

  /// Time of the oldest sample that waits, if any.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> first_time() const noexcept;
  /// Time of the last sample used, if any.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> last_time() const noexcept {
    return last_ ? std::optional(last_->time) : std::nullopt;
  }
  /// When it arrived, if any: host-monotonic for a device.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> last_arrival() const noexcept {
    return last_ ? std::optional(last_->arrival) : std::nullopt;
  }
  /// Thread: any.
  [[nodiscard]] Counts counts() const noexcept {
    return {.used = channel_.used.value(),
            .late = channel_.late.value(),
            .held_ticks = channel_.held_ticks.value(),
            .released_ticks = channel_.released_ticks.value()};
  }

 private:
  [[nodiscard]] Reading reading_at(std::chrono::nanoseconds time) noexcept;
  void consume_until(std::chrono::nanoseconds time) noexcept;
  [[nodiscard]] ContactInput contact_of(const ProbeSample& sample) const noexcept;
  [[nodiscard]] std::chrono::nanoseconds valid_for_last() const noexcept;
  [[nodiscard]] ContactInput released(const ContactInput& last) const noexcept;

  ProbeChannel& channel_;
  Parameters parameters_;
  std::optional<ProbeSample> last_;  ///< the latest sample at or before the time read last
  std::chrono::nanoseconds simulated_ = std::chrono::nanoseconds::min();
};

}  // namespace merkel
