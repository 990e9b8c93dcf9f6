#pragma once

#include <chrono>

#include "core/neurons/neuron_noise.hpp"
#include "core/parameters/parameter_error.hpp"

namespace merkel {

/// The leaky integrate-and-fire neuron, driven by a rate:
/// dv = (I − v/τ)·dt + σ·√dt·ξ, I in Hz and t in s, so that v has no unit. Where v reaches the
/// threshold, there is a spike, and v stays at the reset for the refractory period. Without leak
/// and noise the rate is 1/(1/I + refractory period). Without drive, v is taken as 0 once it is
/// within 0.001 of it, unless the noise does not depend on the drive.
struct IntegrateAndFire {
  double tau_ms = 500.0;                       ///< τ, of the leak
  double threshold = 1.0;                      ///< v of a spike
  double reset = 0.0;                          ///< v after a spike
  double floor = -1.0;                         ///< the least v that noise can lead to
  double refractory_ms = 1.0;                  ///< at least a step; carried within steps
  NeuronNoise noise{.sigma = 0.8, .seed = 1};  ///< σ in 1/√s

  [[nodiscard]] static FieldTable fields();
  /// \param step  with which the neuron will be stepped
  [[nodiscard]] Expected<void, ParameterError> check(std::chrono::nanoseconds step) const;
};

}  // namespace merkel
