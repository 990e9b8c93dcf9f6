#include "core/neurons/integrate_and_fire/integrate_and_fire_group.hpp"

#include <algorithm>
#include <cassert>

#include "core/neurons/integrate_and_fire/integrate_and_fire_kernel.hpp"
#include "core/units.hpp"

namespace merkel {

IntegrateAndFireGroup::IntegrateAndFireGroup(const Parameters& parameters, std::size_t neurons)
    : NeuronGroup(neurons, parameters.step, parameters.patch, parameters.first_neuron),
      neuron_(parameters.neuron),
      v_(whole_blocks(neurons)),
      refractory_left_(whole_blocks(neurons)),
      input_(neurons),
      noise_key_(noise_keys(parameters.neuron.noise.seed, neurons)) {
  assert(parameters.neuron.check(parameters.step));
  reset();
}

void IntegrateAndFireGroup::put_to_rest() noexcept {
  std::fill(v_.begin(), v_.end(), neuron_.reset);
  std::fill(refractory_left_.begin(), refractory_left_.end(), 0.0);
}

std::size_t IntegrateAndFireGroup::take_input(std::span<const double> begin,
                                              std::span<const double> end) noexcept {
  input_.set(begin, end);
  return 0;  // noise never rests
}

void IntegrateAndFireGroup::step_part(const StepCall& part) noexcept {
  step_integrate_and_fire({.v = v_.data(),
                           .refractory_left = refractory_left_.data(),
                           .input_begin = input_.begin.data(),
                           .input_change = input_.change.data(),
                           .noise_key = noise_key_.data(),
                           .call = part,
                           .step = units::s_from(step()),
                           .inverse_tau = 1000.0 / neuron_.tau_ms,
                           .threshold = neuron_.threshold,
                           .reset = neuron_.reset,
                           .floor = neuron_.floor,
                           .refractory = 1e-3 * neuron_.refractory_ms,
                           .sigma = neuron_.noise.sigma});
}

}  // namespace merkel
