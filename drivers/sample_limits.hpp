#pragma once

#include <cmath>

#include "core/records/probe_sample.hpp"

namespace merkel {

/// What no probe on a finger can read. A value beyond is damage or a wrong unit, and stops at the
/// driver, as does a non-finite one.
struct SampleLimits {
  static constexpr double kDepth_mm = 1e3;
  static constexpr double kForce_mN = 1e7;
  static constexpr double kPosition_mm = 1e4;
};

/// Whether a value is finite and of possible magnitude. Real-time: yes.
[[nodiscard]] inline bool plausible(double value, double limit) noexcept {
  return std::fabs(value) <= limit;  // false for NaN
}

/// Whether every channel that a sample carries is plausible. Real-time: yes.
[[nodiscard]] inline bool plausible(const ProbeSample& sample) noexcept {
  return plausible(sample.depth_mm, SampleLimits::kDepth_mm) &&
         plausible(sample.force_mN, SampleLimits::kForce_mN) &&
         plausible(sample.x_mm, SampleLimits::kPosition_mm) &&
         plausible(sample.y_mm, SampleLimits::kPosition_mm);
}

}  // namespace merkel
