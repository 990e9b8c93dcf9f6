#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/records/probe_sample.hpp"
#include "drivers/probe.hpp"

namespace merkel {

/// Measures period and lateness of a device's samples and derives the necessary buffer.
///
/// The loop interpolates between two samples, so it must wait for the second one: for one period
/// plus the transport's jitter. Each second gives the 99.9 % quantile of this time; the median of
/// the last five seconds applies, so that a stall of the host changes nothing for long. A second
/// with another period starts anew. Outages (more than four periods) do not count as jitter.
/// The loop begins with this delay and then measures for itself.
/// Real-time: no. Thread: probe.
class SampleMeter {
 public:
  /// Adds the next sample. True if timing() has changed.
  bool add(const ReadingHead& sample);
  /// Ends the stream; computes the timing from the samples so far.
  bool finish();
  /// Not set until the first second is over.
  [[nodiscard]] const std::optional<SampleTiming>& timing() const noexcept { return timing_; }

  /// The longest silence within a stream of the given period.
  [[nodiscard]] static std::chrono::nanoseconds stale_after(
      std::chrono::nanoseconds delay) noexcept;

 private:
  using Time = std::chrono::nanoseconds;
  struct Step {
    Time interval{0};  ///< since the previous sample
    Time need{0};      ///< from the previous sample to this one's arrival
    Time latency{0};   ///< from this sample to its arrival
  };
  [[nodiscard]] bool window_is_over(const ReadingHead& sample) const noexcept;
  [[nodiscard]] SampleTiming timing_of_window() const;
  bool close_window();

  std::optional<SampleTiming> timing_;
  std::optional<ReadingHead> last_;
  Time window_begin_{0};  ///< arrival
  Time opened_{0};        ///< arrival after which samples count
  std::vector<Step> steps_;
  std::vector<SampleTiming> windows_;  ///< the last seconds at the present rate
};

}  // namespace merkel
