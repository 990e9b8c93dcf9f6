#include "core/neurons/integrate_and_fire/integrate_and_fire_group.hpp"

#include <algorithm>
#include <cassert>

#include "core/neurons/integrate_and_fire/integrate_and_fire_kernel.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

constexpr double kRestBelow = 1e-3;

}  // namespace

IntegrateAndFireGroup::IntegrateAndFireGroup(const Parameters& parameters, std::size_t neurons)
    : NeuronGroup(neurons, parameters.step, parameters.patch, parameters.first_neuron),
      neuron_(parameters.neuron),
      v_(whole_blocks(neurons)),
      refractory_left_(whole_blocks(neurons)),
      input_(neurons),
      resting_(blocks_of(neurons)),
      noise_key_(noise_keys(parameters.neuron.noise.seed, neurons)) {
  assert(parameters.neuron.check(parameters.step));
  reset();
}

void IntegrateAndFireGroup::set_at_rest() noexcept {
  std::fill(v_.begin(), v_.end(), neuron_.reset);
  std::fill(refractory_left_.begin(), refractory_left_.end(), 0.0);
}

std::size_t IntegrateAndFireGroup::take_input(std::span<const double> begin,
                                              std::span<const double> end) noexcept {
  input_.set(begin, end);
  std::size_t count = 0;
  for (std::size_t block = 0; block < resting_.size(); ++block) {
    resting_[block] = at_rest(block) ? 1 : 0;
    count += resting_[block];
  }
  return count;
}

bool IntegrateAndFireGroup::at_rest(std::size_t block) const noexcept {
  if (neuron_.noise.sigma > 0.0 && neuron_.noise.full_drive_Hz == 0.0) return false;
  for (std::size_t i = block * kNeuronBlock; i < (block + 1) * kNeuronBlock; ++i) {
    if (input_.begin[i] != 0.0 || input_.change[i] != 0.0) return false;
    if (v_[i] != 0.0 || refractory_left_[i] != 0.0) return false;
  }
  return true;
}

void IntegrateAndFireGroup::step_part(const StepCall& part) noexcept {
  const double full_Hz = neuron_.noise.full_drive_Hz;
  for_each_awake_run(part, resting_, [&](const StepCall& run) noexcept {
    step_integrate_and_fire({.v = v_.data(),
                             .refractory_left = refractory_left_.data(),
                             .input_begin = input_.begin.data(),
                             .input_change = input_.change.data(),
                             .noise_key = noise_key_.data(),
                             .call = run,
                             .step = units::s_from(step()),
                             .inverse_tau = 1000.0 / neuron_.tau_ms,
                             .threshold = neuron_.threshold,
                             .reset = neuron_.reset,
                             .floor = neuron_.floor,
                             .refractory = 1e-3 * neuron_.refractory_ms,
                             .sigma = neuron_.noise.sigma,
                             .share_per_Hz = full_Hz > 0.0 ? 1.0 / full_Hz : 0.0,
                             .least_share = full_Hz > 0.0 ? 0.0 : 1.0,
                             .rest_below = full_Hz > 0.0 ? kRestBelow : 0.0});
  });
}

}  // namespace merkel
