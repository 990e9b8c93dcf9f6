#pragma once

#include <cmath>

#include "core/records/probe_sample.hpp"

namespace merkel {

/// The largest values that a probe on a finger can measure. Larger values come from damage or a
/// wrong unit; the driver refuses them, as it does non-finite ones.
struct SampleLimits {
  static constexpr double kDepth_mm = 1e3;
  static constexpr double kForce_mN = 1e7;
  static constexpr double kPosition_mm = 1e4;
  static constexpr double kPressure_kPa = 1e5;
};

/// True if a value is finite and within its limit. Real-time: yes.
[[nodiscard]] inline bool plausible(double value, double limit) noexcept {
  return std::fabs(value) <= limit;  // false for NaN
}

/// True if all channels of a sample are plausible. Real-time: yes.
[[nodiscard]] inline bool plausible(const ProbeSample& sample) noexcept {
  return plausible(sample.depth_mm, SampleLimits::kDepth_mm) &&
         plausible(sample.force_mN, SampleLimits::kForce_mN) &&
         plausible(sample.x_mm, SampleLimits::kPosition_mm) &&
         plausible(sample.y_mm, SampleLimits::kPosition_mm) &&
         plausible(sample.zero_mN, SampleLimits::kForce_mN);
}

}  // namespace merkel
