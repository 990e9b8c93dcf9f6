#include "core/neurons/hodgkin_huxley/hodgkin_huxley_group.hpp"

#include <cassert>

#include "core/units.hpp"

namespace merkel {
namespace {

std::variant<HodgkinHuxleyArrays<double>, HodgkinHuxleyArrays<float>> make_arrays(
    const HodgkinHuxleyGroup::Parameters& p, std::size_t neurons,
    const std::optional<LatticeCoupling>& network) {
  const double step_ms = units::ms_from(p.step);
  if (p.precision == Precision::kFloat) {
    return HodgkinHuxleyArrays<float>(p.neuron, p.method, step_ms, neurons, network);
  }
  return HodgkinHuxleyArrays<double>(p.neuron, p.method, step_ms, neurons, network);
}

std::optional<LatticeCoupling> active(const std::optional<LatticeCoupling>& network) {
  return network && network->active() ? network : std::nullopt;
}

}  // namespace

HodgkinHuxleyGroup::HodgkinHuxleyGroup(const Parameters& parameters, std::size_t neurons,
                                       const std::optional<LatticeCoupling>& network)
    : NeuronGroup(neurons, parameters.step, parameters.patch, parameters.first_neuron),
      neuron_(parameters.neuron),
      arrays_(make_arrays(parameters, neurons, active(network))) {
  assert(!network || network->neurons() == neurons);
  if (parameters.freeze_resting) {
    quiescence_.emplace(parameters.resting_states
                            ? parameters.resting_states
                            : std::make_shared<const RestingStates>(parameters.neuron),
                        neurons, active(network) ? network->columns() : 0);
  }
}

double HodgkinHuxleyGroup::potential_mV(std::size_t neuron) const noexcept {
  return std::visit([=](const auto& arrays) { return arrays.state(neuron).V; }, arrays_);
}

Gates HodgkinHuxleyGroup::gates(std::size_t neuron) const noexcept {
  return std::visit([=](const auto& arrays) { return arrays.state(neuron).gates; }, arrays_);
}

void HodgkinHuxleyGroup::set_state(std::size_t neuron, double V_mV, const Gates& gates) noexcept {
  std::visit([&](auto& arrays) { arrays.set_state(neuron, {.V = V_mV, .gates = gates}); }, arrays_);
  if (quiescence_) quiescence_->wake();
  wake();
}

void HodgkinHuxleyGroup::set_at_rest() noexcept {
  const Gates rest = neuron_.steady_gates(neuron_.V_rest);
  for (std::size_t i = 0; i < size(); ++i) set_state(i, neuron_.V_rest, rest);
}

std::size_t HodgkinHuxleyGroup::take_input(std::span<const double> begin,
                                           std::span<const double> end) noexcept {
  return std::visit(
      [&](auto& arrays) -> std::size_t {
        arrays.set_input(begin, end);
        if (!quiescence_) return 0;
        return quiescence_->find(
            begin, end, [&](std::size_t i) { return arrays.state(i); },
            [&](std::size_t i) { return arrays.exchange(i, steps_taken()); });
      },
      arrays_);
}

void HodgkinHuxleyGroup::step_part(const StepCall& part) noexcept {
  const std::uint8_t* const frozen = resting_blocks() > 0 ? quiescence_->frozen() : nullptr;
  std::visit([&](auto& arrays) { arrays.step(part, frozen); }, arrays_);
}

}  // namespace merkel
