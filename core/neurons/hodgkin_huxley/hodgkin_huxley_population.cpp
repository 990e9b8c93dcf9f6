#include "core/neurons/hodgkin_huxley/hodgkin_huxley_population.hpp"

#include <algorithm>
#include <cassert>

#include "core/neurons/event_recorder.hpp"
#include "core/neurons/shared_steps.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

std::variant<Membranes<double>, Membranes<float>> make_membranes(
    const HodgkinHuxleyPopulation::Parameters& p, std::size_t neurons,
    const std::optional<LatticeCoupling>& network) {
  const double step_ms = units::ms_from(p.step);
  if (p.precision == Precision::kFloat) {
    return Membranes<float>(p.neuron, p.method, step_ms, neurons, network);
  }
  return Membranes<double>(p.neuron, p.method, step_ms, neurons, network);
}

std::optional<LatticeCoupling> active(const std::optional<LatticeCoupling>& network) {
  return network && network->active() ? network : std::nullopt;
}

}  // namespace

HodgkinHuxleyPopulation::HodgkinHuxleyPopulation(const Parameters& parameters, std::size_t neurons,
                                                 const std::optional<LatticeCoupling>& network)
    : parameters_(parameters),
      membranes_(make_membranes(parameters, neurons, active(network))),
      resets_(neurons) {
  assert(!network || network->neurons() == neurons);
  if (parameters.freeze_resting) {
    quiescence_.emplace(parameters.neuron, neurons, active(network) ? network->columns() : 0);
  }
}

std::size_t HodgkinHuxleyPopulation::size() const noexcept {
  return std::visit([](const auto& membranes) { return membranes.size(); }, membranes_);
}

double HodgkinHuxleyPopulation::potential_mV(std::size_t neuron) const noexcept {
  return std::visit([=](const auto& membranes) { return membranes.state(neuron).V; }, membranes_);
}

Gates HodgkinHuxleyPopulation::gates(std::size_t neuron) const noexcept {
  return std::visit([=](const auto& membranes) { return membranes.state(neuron).gates; },
                    membranes_);
}

void HodgkinHuxleyPopulation::set_state(std::size_t neuron, double V_mV,
                                        const Gates& gates) noexcept {
  std::visit([&](auto& membranes) { membranes.set_state(neuron, {.V = V_mV, .gates = gates}); },
             membranes_);
  if (quiescence_) quiescence_->wake();
  resting_blocks_ = 0;
}

void HodgkinHuxleyPopulation::reset() noexcept {
  const HodgkinHuxley& neuron = parameters_.neuron;
  const Gates rest = neuron.steady_gates(neuron.V_rest);
  for (std::size_t i = 0; i < size(); ++i) set_state(i, neuron.V_rest, rest);
  resets_.clear();
}

void HodgkinHuxleyPopulation::advance(std::span<const double> current_begin,
                                      std::span<const double> current_end, int steps,
                                      std::chrono::nanoseconds start, SpikeBuffer& spikes,
                                      WorkerTeam* team) noexcept {
  assert(current_begin.size() == size() && current_end.size() == size());
  const std::uint8_t* frozen = nullptr;
  resting_blocks_ = 0;
  std::visit(
      [&](auto& membranes) {
        membranes.set_currents(current_begin, current_end);
        if (!quiescence_) return;
        resting_blocks_ = quiescence_->find(
            current_begin, current_end, [&](std::size_t i) { return membranes.state(i); },
            [&](std::size_t i) { return membranes.exchange(i); });
      },
      membranes_);
  if (resting_blocks_ > 0) frozen = quiescence_->frozen();
  resets_.clear();
  const StepTimes times{start, parameters_.step, parameters_.patch};
  std::visit(
      [&](auto& membranes) {
        share_steps(size(), team,
                    [&](std::size_t first, std::size_t last, WorkerTeam* peers) noexcept {
                      MembraneRecorder recorder(times, parameters_.neuron.spike_threshold_mV,
                                                spikes, resets_);
                      membranes.step(first, last, steps, frozen, recorder, peers);
                    });
        membranes.finish_steps(steps);
      },
      membranes_);
}

}  // namespace merkel
