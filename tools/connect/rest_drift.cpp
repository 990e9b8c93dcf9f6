#include "tools/connect/rest_drift.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <span>
#include <utility>

#include <fmt/core.h>

#include "core/math/line_fit.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "realtime/threads/thread_setup.hpp"
#include "tools/exit_code.hpp"
#include "tools/run/stop_signal.hpp"
#include "tools/run/terminal_line.hpp"

namespace merkel {

void RestDrift::add(double time_s, double value) {
  if (count_ > 0 && time_s >= second_ + 1.0) {
    const auto count = static_cast<double>(count_);
    const double mean = sum_ / count;
    points_.emplace_back(second_ + time_sum_ / count, origin_ + mean);
    variances_ += std::max(0.0, sum2_ / count - mean * mean);
    if (const auto present = slope()) largest_ = std::max(largest_, std::fabs(*present));
    count_ = 0;
    const double passed = std::floor(time_s - second_);
    second_ += passed;
    seconds_ += static_cast<std::size_t>(passed);
  }
  if (count_ == 0) {
    if (points_.empty()) second_ = time_s;
    origin_ = value;
    time_sum_ = sum_ = sum2_ = 0.0;
  }
  ++count_;
  time_sum_ += time_s - second_;
  sum_ += value - origin_;
  sum2_ += (value - origin_) * (value - origin_);
}

std::optional<double> RestDrift::slope() const {
  const std::size_t count = std::min(points_.size(), kWindow);
  if (count < kMin) return std::nullopt;
  return fit_line(std::span(points_).last(count)).slope();
}

double RestDrift::noise() const {
  return points_.empty() ? 0.0 : std::sqrt(variances_ / static_cast<double>(points_.size()));
}

bool RestDrift::is_warm() const {
  const auto present = slope();
  return seconds_ >= kWindow && present &&
         std::fabs(*present) * static_cast<double>(kWindow) < 2.0 * noise();
}

std::string drift_text(const RestDrift& drift, bool force) {
  const double scale = force ? units::mN_from_N(1.0) : 1e3;
  const char* const unit = force ? "mN" : "µm";
  const auto slope = drift.slope();
  if (!slope) return fmt::format("drift at rest: not known after {} s", drift.seconds());
  return fmt::format(
      "drift at rest: {0:+.2g} {1}/s (largest {2:.2g} {1}/s) over {3} s, noise {4:.2g} {1}; {5}",
      *slope * scale, unit, drift.largest_slope() * scale, drift.seconds(), drift.noise() * scale,
      drift.is_warm()                        ? "the sensor has warmed up"
      : drift.seconds() < RestDrift::kWindow ? "a minute is needed to tell whether it has warmed up"
                                             : "the sensor is still warming up");
}

std::string drift_line(const RestDrift& drift) {
  constexpr double kTimes = 3.0;
  constexpr double kMin_mN_per_s = 0.05;
  if (!drift.slope()) return {};
  const double largest_mN_per_s = units::mN_from_N(drift.largest_slope());
  return fmt::format(
      "zero_drift_mN_per_s = {:.2g}  # three times the drift of {:.2g} mN/s that was measured\n",
      std::max(kTimes * largest_mN_per_s, kMin_mN_per_s), largest_mN_per_s);
}

Expected<RestDrift, SetupError> measure_rest(Probe& probe, double seconds, LatencyHistogram* reads,
                                             HostClock& clock) {
  const bool force = (probe.info().channels & ProbeSample::kForce) != 0U;
  std::atomic<bool> stopped{false};
  const StopSignal stop(stopped);
  TerminalLine terminal;
  RestDrift drift;
  Readings readings = probe.readings();
  const auto end = clock.now() + units::nanoseconds_from_s(seconds);
  std::size_t shown = 0;
  bool warm = false;
  while (!stopped && clock.now() < end) {
    const auto before = processor_time(::pthread_self());
    const auto count = probe.read(readings, std::chrono::milliseconds{50});
    if (!count) return unavailable(probe.error_message());
    if (reads != nullptr && *count > 0) reads->record(processor_time(::pthread_self()) - before);
    terminal.print_notices(probe.take_notices());
    for (std::size_t i = 0; i < *count; ++i) {
      const auto sample = readings.sample(i);
      if (!sample) continue;
      drift.add(units::s_from(sample->time),
                force ? units::N_from_mN(sample->force_mN) : sample->depth_mm);
    }
    if (drift.seconds() == shown) continue;
    shown = drift.seconds();
    terminal.show({drift_text(drift, force), "Ctrl-C ends the measurement"});
    if (drift.is_warm() && !std::exchange(warm, true)) {
      terminal.print_line(fmt::format("the sensor has warmed up after {} s", shown));
    }
  }
  return drift;
}

}  // namespace merkel
