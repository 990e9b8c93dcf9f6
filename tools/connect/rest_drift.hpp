#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/probe.hpp"
#include "drivers/probes/host_clock.hpp"
#include "realtime/queues/latency_histogram.hpp"

namespace merkel {

/// The drift of a sensor that nothing touches: the slope of the means of whole seconds. A second
/// without a value has none.
class RestDrift {
 public:
  static constexpr std::size_t kWindow = 60;  ///< means from which the present slope is fitted
  static constexpr std::size_t kMin = 5;

  /// \param time_s  increasing
  void add(double time_s, double value);

  /// Whole seconds so far.
  [[nodiscard]] std::size_t seconds() const noexcept { return seconds_; }
  /// The present slope, per s, of the last kWindow means; nothing: fewer than kMin.
  [[nodiscard]] std::optional<double> slope() const;
  /// The largest magnitude that it had.
  [[nodiscard]] double largest_slope() const noexcept { return largest_; }
  /// Standard deviation within a second.
  [[nodiscard]] double noise() const;
  /// True once the drift in kWindow s is less than twice the noise.
  [[nodiscard]] bool is_warm() const;

 private:
  std::vector<std::pair<double, double>> points_;  ///< s, means
  std::size_t seconds_ = 0;
  double second_ = 0.0;  ///< the present one
  double origin_ = 0.0;  ///< its first value, from which its sums are counted
  double time_sum_ = 0.0, sum_ = 0.0, sum2_ = 0.0;
  std::size_t count_ = 0;
  double variances_ = 0.0;  ///< sum over the seconds
  double largest_ = 0.0;
};

/// Measures a probe that nothing touches, its force or else its depth, for some seconds or until
/// the user interrupts; shows the drift meanwhile, and says when the sensor has warmed up.
/// \param reads  records the processor time of each read that brought readings; null: none
/// Thread: probe.
[[nodiscard]] Expected<RestDrift, SetupError> measure_rest(Probe& probe, double seconds,
                                                           LatencyHistogram* reads = nullptr,
                                                           HostClock& clock = HostClock::real());

/// "drift at rest: +0.31 mN/s (largest 0.9 mN/s) over 120 s, noise 2 mN; the sensor has warmed up".
[[nodiscard]] std::string drift_text(const RestDrift& drift, bool force);

/// The key zero_drift_mN_per_s for a force, three times the largest drift; empty: not known.
[[nodiscard]] std::string drift_line(const RestDrift& drift);

}  // namespace merkel
