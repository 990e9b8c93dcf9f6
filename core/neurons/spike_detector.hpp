#pragma once

#include <cmath>
#include <cstddef>

#include "core/neurons/step_call.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// A potential beyond this counts as non-finite: no valid state reaches it.
inline constexpr double kRunaway_mV = 1e4;

/// Whether V rose through the threshold within a step. Real-time: yes.
template <class Real>
[[nodiscard]] bool crosses_upward(Real V_before_mV, Real V_after_mV,
                                  Real threshold_mV) noexcept MERKEL_REALTIME {
  return V_before_mV < threshold_mV && V_after_mV >= threshold_mV;
}

/// The fraction of a step at which V, linear within the step, reaches the threshold.
[[nodiscard]] inline double linear_crossing(double V_before_mV, double V_after_mV,
                                            double threshold_mV) noexcept MERKEL_REALTIME {
  return (threshold_mV - V_before_mV) / (V_after_mV - V_before_mV);
}

/// The same with the cubic that also matches the slopes at both ends (Hermite). Its error is
/// fourth order in the step instead of second order, so it does not mask the error of RK4.
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

/// Checks `count` neurons from i on after a step. Reports each spike at its crossing time; resets
/// and reports each non-finite state. `crossing(lane)` is the fraction of the step at which a
/// neuron crosses; `rest(neuron)` puts it at rest. Neurons from call.last on are padding and are
/// not reported. Real-time: yes.
template <class Real, class Crossing, class Rest>
void observe_step(const StepCall& call, int step, std::size_t i, std::size_t count,
                  Real threshold_mV, const Real* before, const Real* after, Crossing crossing,
                  Rest rest) noexcept {
  for (std::size_t lane = 0; lane < count; ++lane) {
    const std::size_t neuron = i + lane;
    if (!(std::fabs(after[lane]) < static_cast<Real>(kRunaway_mV))) {
      rest(neuron);
      if (neuron < call.last) call.observer->reset(neuron, step);
    } else if (crosses_upward(before[lane], after[lane], threshold_mV) && neuron < call.last) {
      call.observer->spiked(neuron, step, crossing(lane));
    }
  }
}

}  // namespace merkel
