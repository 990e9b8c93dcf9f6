#pragma once

#include <chrono>

#include "core/neurons/neuron_noise.hpp"
#include "core/parameters/parameter_error.hpp"

namespace merkel {

/// The leaky integrate-and-fire neuron, driven by a rate:
/// dv = (I − v/τ)·dt + σ·√dt·ξ, I in Hz and t in s, so that v is dimensionless.
/// The neuron spikes when v reaches the threshold; v then stays at the reset value for the
/// refractory period. Without leak and noise, the rate is 1/(1/I + refractory period). Without
/// drive, v is set to 0 once it is within 0.001 of 0, unless the noise is independent of the drive.
struct IntegrateAndFire {
  double tau_ms = 500.0;       ///< τ of the leak
  double threshold = 1.0;      ///< v that triggers a spike
  double reset = 0.0;          ///< v after a spike
  double floor = -1.0;         ///< lower limit of v
  double refractory_ms = 1.0;  ///< at least one step; need not be a whole number of steps
  NeuronNoise noise{.sigma = 0.8, .seed = 1};  ///< σ in 1/√s

  [[nodiscard]] static FieldTable fields();
  /// \param step  of the neuron
  [[nodiscard]] Expected<void, ParameterError> check(std::chrono::nanoseconds step) const;
};

}  // namespace merkel
