#include "core/neurons/integrate_and_fire/integrate_and_fire_population.hpp"

#include <algorithm>
#include <cassert>

#include "core/neurons/event_recorder.hpp"
#include "core/neurons/integrate_and_fire/integrate_and_fire_kernel.hpp"
#include "core/neurons/noise_keys.hpp"
#include "core/neurons/shared_steps.hpp"
#include "core/units.hpp"

namespace merkel {

IntegrateAndFirePopulation::IntegrateAndFirePopulation(const Parameters& parameters,
                                                       std::size_t neurons)
    : parameters_(parameters),
      neurons_(neurons),
      v_(whole_blocks(neurons)),
      refractory_left_(whole_blocks(neurons)),
      current_begin_(whole_blocks(neurons)),
      current_change_(whole_blocks(neurons)),
      noise_key_(noise_keys(parameters.neuron.noise.seed, neurons)) {
  assert(parameters.neuron.check(parameters.step));
  reset();
}

void IntegrateAndFirePopulation::reset() noexcept {
  std::fill(v_.begin(), v_.end(), parameters_.neuron.reset);
  std::fill(refractory_left_.begin(), refractory_left_.end(), 0.0);
  steps_taken_ = 0;
}

void IntegrateAndFirePopulation::advance(std::span<const double> current_begin,
                                         std::span<const double> current_end, int steps,
                                         std::chrono::nanoseconds start, SpikeBuffer& spikes,
                                         WorkerTeam* team) noexcept {
  assert(current_begin.size() == size() && current_end.size() == size());
  for (std::size_t i = 0; i < neurons_; ++i) {
    current_begin_[i] = current_begin[i];
    current_change_[i] = current_end[i] - current_begin[i];
  }
  const IntegrateAndFire& neuron = parameters_.neuron;
  IntegrateAndFireArguments arguments{.v = v_.data(),
                                      .refractory_left = refractory_left_.data(),
                                      .current_begin = current_begin_.data(),
                                      .current_change = current_change_.data(),
                                      .noise_key = noise_key_.data(),
                                      .steps = steps,
                                      .steps_before = steps_taken_,
                                      .step = units::s_from(parameters_.step),
                                      .inverse_tau = 1000.0 / neuron.tau_ms,
                                      .threshold = neuron.threshold,
                                      .reset = neuron.reset,
                                      .floor = neuron.floor,
                                      .refractory = 1e-3 * neuron.refractory_ms,
                                      .sigma = neuron.noise.sigma};
  const StepTimes times{start, parameters_.step, parameters_.patch};
  share_steps(neurons_, team, [&](std::size_t first, std::size_t last, WorkerTeam*) noexcept {
    SpikeRecorder recorder(times, spikes);
    IntegrateAndFireArguments part = arguments;
    part.first = first;
    part.last = last;
    part.observer = &recorder;
    step_integrate_and_fire(part);
  });
  steps_taken_ += static_cast<std::uint64_t>(steps);
}

}  // namespace merkel
