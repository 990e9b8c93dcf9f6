#include "core/neurons/connor_stevens/connor_stevens_population.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/neurons/event_recorder.hpp"
#include "core/neurons/noise_keys.hpp"
#include "core/neurons/shared_steps.hpp"
#include "core/units.hpp"

namespace merkel {

ConnorStevensPopulation::ConnorStevensPopulation(const Parameters& parameters, std::size_t neurons)
    : parameters_(parameters),
      neurons_(neurons),
      gate_table_(units::ms_from(parameters.step)),
      V_(whole_blocks(neurons)),
      current_begin_(whole_blocks(neurons)),
      current_change_(whole_blocks(neurons)),
      noise_key_(noise_keys(parameters.neuron.noise.seed, neurons)) {
  assert(parameters.neuron.check());
  for (AlignedArray<double>& gate : gates_) gate = AlignedArray<double>(whole_blocks(neurons));
  const ConnorStevens::Gates gates = ConnorStevens::kinetics(resting_V_mV_).steady;
  const double steady[] = {gates.m, gates.h, gates.n, gates.a, gates.b};
  std::copy(std::begin(steady), std::end(steady), resting_gates_);
  reset();
  // The state of rest is the one that a second without noise leads to; one neuron's is all's.
  current_begin_[0] = parameters.holding_current_uA_per_cm2;
  SpikeBuffer ignored(1);
  SpikeRecorder recorder({}, ignored);
  ConnorStevensArguments settle =
      arguments(static_cast<int>(std::chrono::seconds{1} / parameters.step));
  settle.noise_per_step = 0.0;
  settle.last = 1;
  settle.observer = &recorder;
  step_connor_stevens(settle);
  resting_V_mV_ = V_[0];
  for (std::size_t k = 0; k < GateTable::kGates; ++k) resting_gates_[k] = gates_[k][0];
  reset();
}

ConnorStevensArguments ConnorStevensPopulation::arguments(int steps) noexcept {
  const double step_ms = units::ms_from(parameters_.step);
  ConnorStevensArguments all{.V = V_.data(),
                             .current_begin = current_begin_.data(),
                             .current_change = current_change_.data(),
                             .noise_key = noise_key_.data(),
                             .steps = steps,
                             .steps_before = steps_taken_,
                             .step_ms = step_ms,
                             .noise_per_step = parameters_.neuron.noise.sigma * std::sqrt(step_ms),
                             .neuron = &parameters_.neuron,
                             .gate_table = gate_table_.data()};
  for (std::size_t k = 0; k < GateTable::kGates; ++k) all.gates[k] = gates_[k].data();
  return all;
}

void ConnorStevensPopulation::reset() noexcept {
  std::fill(V_.begin(), V_.end(), resting_V_mV_);
  for (std::size_t k = 0; k < GateTable::kGates; ++k) {
    std::fill(gates_[k].begin(), gates_[k].end(), resting_gates_[k]);
  }
  steps_taken_ = 0;
}

void ConnorStevensPopulation::advance(std::span<const double> current_begin,
                                      std::span<const double> current_end, int steps,
                                      std::chrono::nanoseconds start, SpikeBuffer& spikes,
                                      WorkerTeam* team) noexcept {
  assert(current_begin.size() == size() && current_end.size() == size());
  for (std::size_t i = 0; i < neurons_; ++i) {
    current_begin_[i] = current_begin[i];
    current_change_[i] = current_end[i] - current_begin[i];
  }
  const ConnorStevensArguments all = arguments(steps);
  const StepTimes times{start, parameters_.step, parameters_.patch};
  share_steps(neurons_, team, [&](std::size_t first, std::size_t last, WorkerTeam*) noexcept {
    SpikeRecorder recorder(times, spikes);
    ConnorStevensArguments part = all;
    part.first = first;
    part.last = last;
    part.observer = &recorder;
    step_connor_stevens(part);
  });
  steps_taken_ += static_cast<std::uint64_t>(steps);
}

}  // namespace merkel
