#include "core/neurons/integrate_and_fire/integrate_and_fire.hpp"

#include "core/units.hpp"

namespace merkel {

Expected<void, ParameterError> IntegrateAndFire::check(std::chrono::nanoseconds step) const {
  return ParameterCheck()
      .positive("neuron.tau_ms", tau_ms)
      .finite("neuron.threshold", threshold)
      .finite("neuron.reset", reset)
      .finite("neuron.floor", floor)
      .require(reset < threshold, "neuron.reset", "must lie below neuron.threshold")
      .require(floor <= reset, "neuron.floor", "must not lie above neuron.reset")
      .positive("neuron.refractory_ms", refractory_ms)
      .require(refractory_ms >= units::ms_from(step), "neuron.refractory_ms",
               "must be at least neuron.step_us: a step holds one spike")
      .not_negative("neuron.noise", noise.sigma)
      .require(units::ms_from(step) <= 0.1 * tau_ms, "neuron.step_us",
               "must be at most a tenth of neuron.tau_ms: the leak is stepped by Euler's method")
      .result();
}

}  // namespace merkel
