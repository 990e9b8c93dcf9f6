#include "core/neurons/integrate_and_fire/integrate_and_fire.hpp"

#include "core/units.hpp"

namespace merkel {

FieldTable IntegrateAndFire::fields() {
  using P = IntegrateAndFire;
  static constexpr Range kPotential = from_to(-1e6, 1e6);
  static constexpr Field kFields[] = {
      {"tau_ms", "ms", positive(1e6), "time constant of the leak", at<&P::tau_ms>, "", true},
      {"threshold", "", kPotential, "potential at which the neuron spikes", at<&P::threshold>},
      {"reset", "", kPotential, "potential after a spike", at<&P::reset>},
      {"floor", "", kPotential, "lower limit of the potential", at<&P::floor>},
      {"refractory_ms", "ms", positive(1e6), "refractory period, at least one step",
       at<&P::refractory_ms>, "", true},
      {"noise", "1/√s", not_negative(1e6), "white noise: a step dt adds noise·√dt·ξ; requires seed",
       [](void* p) -> FieldPointer { return &static_cast<P*>(p)->noise.sigma; }, "", true},
      {"seed", "", any_value(), "seed of the noise",
       [](void* p) -> FieldPointer { return &static_cast<P*>(p)->noise.seed; }}};
  return {"neuron", kFields};
}

Expected<void, ParameterError> IntegrateAndFire::check(std::chrono::nanoseconds step) const {
  return ParameterCheck()
      .fields(*this)
      .require(reset < threshold, "neuron.reset", "must lie below neuron.threshold")
      .require(floor <= reset, "neuron.floor", "must not lie above neuron.reset")
      .require(refractory_ms >= units::ms_from(step), "neuron.refractory_ms",
               "must be at least neuron.step_us: a step can contain only one spike")
      .require(units::ms_from(step) <= 0.1 * tau_ms, "neuron.step_us",
               "must be at most a tenth of neuron.tau_ms: the leak is stepped by Euler's method")
      .result();
}

}  // namespace merkel
