#pragma once

#include "core/parameters/parameter_error.hpp"

namespace merkel {

/// α(v) = rate·φ((shift−v)/slope) with φ(x) = x/(eˣ−1): opening rate of the n and m gates.
struct LinoidRate {
  double rate_per_ms;
  double shift_mV;
  double slope_mV;
  bool operator==(const LinoidRate&) const = default;
};

/// β(v) = rate·e^{−v/slope}.
struct ExponentialRate {
  double rate_per_ms;
  double slope_mV;
  bool operator==(const ExponentialRate&) const = default;
};

/// β(v) = rate/(e^{(shift−v)/slope}+1).
struct LogisticRate {
  double rate_per_ms;
  double shift_mV;
  double slope_mV;
  bool operator==(const LogisticRate&) const = default;
};

/// φ(x) = x/(eˣ−1), φ(0) = 1, accurate to rounding everywhere. The direct form is wrong by 10 % at
/// 1e-15 and is 0/0 at 0. Real-time: yes.
[[nodiscard]] double linoid(double x) noexcept;

/// The gating variables n, m, h, each in [0, 1].
struct Gates {
  double n = 0.0;
  double m = 0.0;
  double h = 0.0;
};

/// Opening and closing rates of the three gates, 1/ms: ẋ = α(1−x) − βx.
struct GateRates {
  Gates alpha;
  Gates beta;
};

/// Parameters of the Hodgkin-Huxley neuron with an L-type calcium term (Eq. 11-13, corrected).
///
/// C·V̇ = gl(El−V) + gNa·m³h(ENa−V) + gK·n⁴(EK−V) + gCaL·m·h(ECa−V) + I, with v = V−V_r and
/// αn = 0.1φ((10−v)/10), βn = 0.125e^{−v/80}; αm = φ((25−v)/10), βm = 4e^{−v/18};
/// αh = 0.07e^{−v/20}, βh = 1/(e^{(30−v)/10}+1). Conductances in mS/cm², potentials in mV.
struct HodgkinHuxley {
  double capacitance_uF_per_cm2 = 1.0;
  double g_Na = 120.0;
  double g_K = 36.0;
  double g_L = 0.3;
  double g_CaL = 0.1;
  double E_Na = 50.0;
  double E_K = -77.0;
  double E_Ca = 120.0;
  double V_rest = -65.0;  ///< V_r, exactly the resting potential due to leak_reversal_mV
  double spike_threshold_mV = -20.0;  ///< an upward crossing is a spike

  LinoidRate alpha_n{.rate_per_ms = 0.1, .shift_mV = 10.0, .slope_mV = 10.0};
  ExponentialRate beta_n{.rate_per_ms = 0.125, .slope_mV = 80.0};
  LinoidRate alpha_m{.rate_per_ms = 1.0, .shift_mV = 25.0, .slope_mV = 10.0};
  ExponentialRate beta_m{.rate_per_ms = 4.0, .slope_mV = 18.0};
  ExponentialRate alpha_h{.rate_per_ms = 0.07, .slope_mV = 20.0};
  LogisticRate beta_h{.rate_per_ms = 1.0, .shift_mV = 30.0, .slope_mV = 10.0};

  bool operator==(const HodgkinHuxley&) const = default;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;

  /// α and β of every gate at a membrane potential. Real-time: yes.
  [[nodiscard]] GateRates rates(double V_mV) const noexcept;
  /// α/(α+β) of every gate. Real-time: yes.
  [[nodiscard]] Gates steady_gates(double V_mV) const noexcept;
  /// El, chosen so that V_r is a fixed point at zero current: −56.3469184654 mV with the defaults.
  [[nodiscard]] double leak_reversal_mV() const noexcept;
  /// Σ g and Σ g·E of all channels: the ionic current is driven − conductance·V. Real-time: yes.
  struct Channels {
    double conductance = 0.0;  ///< mS/cm²
    double driven = 0.0;       ///< µA/cm²
  };
  [[nodiscard]] Channels channels(const Gates& gates, double leak_reversal_mV) const noexcept;
};

}  // namespace merkel
