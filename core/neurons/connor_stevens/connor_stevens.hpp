#pragma once

#include "core/neurons/neuron_noise.hpp"
#include "core/parameters/parameter_error.hpp"

namespace merkel {

/// Parameters of the Hodgkin-Huxley neuron with an A-current of Connor & Stevens (1971), in the
/// form and with the rates of Dayan & Abbott, Theoretical Neuroscience (2001), section 6.2:
/// C·V̇ = gl(El−V) + gNa·m³h(ENa−V) + gK·n⁴(EK−V) + gA·a³b(EA−V) + I + noise.
/// Unlike the paper's neuron, it can fire at arbitrarily low rates (class I), from 8.1 µA/cm².
struct ConnorStevens {
  double capacitance_uF_per_cm2 = 1.0;
  double g_Na = 120.0;  ///< mS/cm²
  double g_K = 20.0;
  double g_A = 47.7;
  double g_L = 0.3;
  double E_Na = 55.0;  ///< mV
  double E_K = -72.0;
  double E_A = -75.0;
  double E_L = -17.0;
  double spike_threshold_mV = -20.0;           ///< an upward crossing is a spike
  NeuronNoise noise{.sigma = 0.8, .seed = 1};  ///< σ in mV/√ms

  /// The gating variables, each in [0, 1]; a and b gate the A-current.
  struct Gates {
    double m = 0.0;
    double h = 0.0;
    double n = 0.0;
    double a = 0.0;
    double b = 0.0;
  };
  /// Steady states and time constants of the gates at a potential.
  struct Kinetics {
    Gates steady;
    Gates tau_ms;
  };

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
  /// Real-time: yes.
  [[nodiscard]] static Kinetics kinetics(double V_mV) noexcept;
};

}  // namespace merkel
