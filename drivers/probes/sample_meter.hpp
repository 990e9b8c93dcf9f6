#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/records/probe_sample.hpp"
#include "drivers/probe.hpp"

namespace merkel {

/// Measures how often a device's samples come and how late, and derives the buffer they need.
///
/// Between two samples the loop interpolates, so it must wait for the second of them: from the time
/// of one sample to the arrival of the next is one period and the transport's jitter. The first
/// second gives the 99.9 % quantile of that; afterwards every second is compared with it, and where
/// two in a row need more, or the period has changed, the timing widens. It never shrinks. Outages
/// (more than four periods) are no jitter. Real-time: no. Thread: probe.
class SampleMeter {
 public:
  /// Takes the next sample. True where timing() has changed.
  bool add(const ProbeSample& sample);
  /// The stream has ended: what came must do.
  bool finish();
  /// Not set until the first second is over.
  [[nodiscard]] const std::optional<SampleTiming>& timing() const noexcept { return timing_; }

  /// Silences shorter than this are part of a stream of the given period.
  [[nodiscard]] static std::chrono::nanoseconds stale_after(
      std::chrono::nanoseconds delay) noexcept;

 private:
  using Time = std::chrono::nanoseconds;
  struct Step {
    Time interval{0};  ///< from the sample before
    Time need{0};      ///< from the sample before to this one's arrival
    Time latency{0};   ///< from this sample to its arrival
  };
  [[nodiscard]] bool window_is_over(const ProbeSample& sample) const noexcept;
  [[nodiscard]] SampleTiming timing_of_window() const;
  bool close_window();

  std::optional<SampleTiming> timing_;
  std::optional<ProbeSample> last_;
  Time window_begin_{0};  ///< arrival
  std::vector<Step> steps_;
  bool tight_ = false;  ///< the window before needed more than the timing allows
};

}  // namespace merkel
