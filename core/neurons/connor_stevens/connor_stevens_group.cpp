#include "core/neurons/connor_stevens/connor_stevens_group.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/units.hpp"

namespace merkel {
namespace {

constexpr double kFirstV_mV = -68.0;  ///< from which a neuron settles to rest

/// Ignores the spikes while the neuron settles to rest.
class SilentObserver final : public StepObserver {
 public:
  void spiked(std::size_t, int, double) noexcept override {}
  void reset(std::size_t, int) noexcept override {}
};

}  // namespace

ConnorStevensGroup::ConnorStevensGroup(const Parameters& parameters, std::size_t neurons)
    : NeuronGroup(neurons, parameters.step, parameters.patch, parameters.first_neuron),
      neuron_(parameters.neuron),
      holding_current_(parameters.holding_current_uA_per_cm2),
      full_noise_current_(parameters.full_noise_current_uA_per_cm2),
      resting_(blocks_of(neurons)),
      V_(whole_blocks(neurons)),
      input_(neurons),
      noise_key_(noise_keys(parameters.neuron.noise.seed, neurons)),
      rest_(parameters.rest ? parameters.rest : rest_of(parameters)) {
  assert(parameters.neuron.check());
  for (AlignedArray<double>& gate : gates_) gate = AlignedArray<double>(whole_blocks(neurons));
  reset();
}

std::shared_ptr<const ConnorStevensGroup::Rest> ConnorStevensGroup::rest_of(
    const Parameters& parameters) {
  const ConnorStevens::Gates steady = ConnorStevens::kinetics(kFirstV_mV).steady;
  const auto rest =
      std::make_shared<Rest>(Rest{.gate_table = GateTable(units::ms_from(parameters.step)),
                                  .V_mV = kFirstV_mV,
                                  .gates = {steady.m, steady.h, steady.n, steady.a, steady.b}});
  Parameters one = parameters;
  one.rest = rest;
  ConnorStevensGroup neuron(one, 1);
  neuron.input_.begin[0] = parameters.holding_current_uA_per_cm2;
  SilentObserver observer;
  ConnorStevensArguments settle =
      neuron.arguments({.last = 1,
                        .steps = static_cast<int>(std::chrono::seconds{1} / parameters.step),
                        .observer = &observer});
  settle.noise_per_step = 0.0;
  step_connor_stevens(settle);
  rest->V_mV = neuron.V_[0];
  for (std::size_t k = 0; k < GateTable::kGates; ++k) rest->gates[k] = neuron.gates_[k][0];
  return rest;
}

ConnorStevensArguments ConnorStevensGroup::arguments(const StepCall& part) noexcept {
  const double step_ms = units::ms_from(step());
  ConnorStevensArguments all{.V = V_.data(),
                             .input_begin = input_.begin.data(),
                             .input_change = input_.change.data(),
                             .noise_key = noise_key_.data(),
                             .call = part,
                             .step_ms = step_ms,
                             .noise_per_step = neuron_.noise.sigma * std::sqrt(step_ms),
                             .quiet_input = holding_current_,
                             .share_per_input = full_noise_current_ > holding_current_
                                                    ? 1.0 / (full_noise_current_ - holding_current_)
                                                    : 0.0,
                             .least_share = full_noise_current_ > holding_current_ ? 0.0 : 1.0,
                             .neuron = &neuron_,
                             .gate_table = rest_->gate_table.data(),
                             .resting_V_mV = rest_->V_mV};
  for (std::size_t k = 0; k < GateTable::kGates; ++k) {
    all.gates[k] = gates_[k].data();
    all.resting_gates[k] = rest_->gates[k];
  }
  return all;
}

void ConnorStevensGroup::set_at_rest() noexcept {
  std::fill(V_.begin(), V_.end(), rest_->V_mV);
  for (std::size_t k = 0; k < GateTable::kGates; ++k) {
    std::fill(gates_[k].begin(), gates_[k].end(), rest_->gates[k]);
  }
}

std::size_t ConnorStevensGroup::take_input(std::span<const double> begin,
                                           std::span<const double> end) noexcept {
  input_.set(begin, end);
  std::size_t count = 0;
  for (std::size_t block = 0; block < resting_.size(); ++block) {
    resting_[block] = comes_to_rest(block) ? 1 : 0;
    count += resting_[block];
  }
  return count;
}

bool ConnorStevensGroup::comes_to_rest(std::size_t block) noexcept {
  if (neuron_.noise.sigma > 0.0 && !(full_noise_current_ > holding_current_)) return false;
  const std::size_t first = block * kNeuronBlock;
  const std::size_t last = std::min(first + kNeuronBlock, size());
  for (std::size_t i = first; i < last; ++i) {
    if (input_.begin[i] != holding_current_ || input_.change[i] != 0.0) return false;
    if (!(std::fabs(V_[i] - rest_->V_mV) < 1e-3)) return false;
    for (std::size_t k = 0; k < GateTable::kGates; ++k) {
      if (!(std::fabs(gates_[k][i] - rest_->gates[k]) < 1e-5)) return false;
    }
  }
  for (std::size_t i = first; i < last; ++i) {
    V_[i] = rest_->V_mV;
    for (std::size_t k = 0; k < GateTable::kGates; ++k) gates_[k][i] = rest_->gates[k];
  }
  return true;
}

void ConnorStevensGroup::step_part(const StepCall& part) noexcept {
  for_each_awake_run(part, resting_,
                     [&](const StepCall& run) noexcept { step_connor_stevens(arguments(run)); });
}

}  // namespace merkel
