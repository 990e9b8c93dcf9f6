#pragma once

#include <algorithm>

#include "core/realtime_tag.hpp"

namespace merkel {

/// Whether V rose through the threshold within a step. Real-time: yes.
[[nodiscard]] inline bool crosses_upward(double V_before_mV, double V_after_mV,
                                         double threshold_mV) noexcept MERKEL_REALTIME {
  return V_before_mV < threshold_mV && V_after_mV >= threshold_mV;
}

/// The fraction of a step at which V, a straight line across it, reaches the threshold.
[[nodiscard]] inline double linear_crossing(double V_before_mV, double V_after_mV,
                                            double threshold_mV) noexcept MERKEL_REALTIME {
  return (threshold_mV - V_before_mV) / (V_after_mV - V_before_mV);
}

/// The same with the cubic that also matches the slopes at both ends (Hermite): the error falls
/// with the fourth power of the step instead of the second, and so does not hide that of RK4.
/// Slopes in mV per step. Bisection to 2⁻⁴⁰ of the step.
[[nodiscard]] inline double hermite_crossing(double V_before_mV, double slope_before,
                                             double V_after_mV, double slope_after,
                                             double threshold_mV) noexcept MERKEL_REALTIME {
  const double rise = V_after_mV - V_before_mV;
  const double c2 = 3.0 * rise - 2.0 * slope_before - slope_after;
  const double c3 = slope_before + slope_after - 2.0 * rise;
  double low = 0.0;
  double high = 1.0;
  for (int halving = 0; halving < 40; ++halving) {
    const double x = 0.5 * (low + high);
    const double V = V_before_mV + x * (slope_before + x * (c2 + x * c3));
    (V < threshold_mV ? low : high) = x;
  }
  return high;
}

}  // namespace merkel
