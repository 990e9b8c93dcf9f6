#include "core/neuron/hodgkin_huxley_population.hpp"

#include <algorithm>
#include <cassert>

#include "core/units.hpp"

namespace merkel {
namespace {

constexpr int kMostParts = 16;
/// Below so many neurons a part, sharing the work costs more than it saves.
constexpr std::size_t kLeastPart = 1024;

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
  if (neurons < 2 * kLeastPart) return;
  for (int part = 1; part < kMostParts; ++part) {
    parts_.push_back({SpikeBuffer(neurons), SpikeBuffer(neurons / 2 + kNeuronBlock)});
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

int HodgkinHuxleyPopulation::parts_for(const WorkerTeam* team) const noexcept {
  if (team == nullptr) return 1;
  const int worth = static_cast<int>(std::min<std::size_t>(size() / kLeastPart, kMostParts));
  return std::clamp(worth, 1, team->size());
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
  run(parts_for(team), steps, frozen, start, spikes, team);
  std::visit([steps](auto& membranes) { membranes.finish_steps(steps); }, membranes_);
}

/// What the parts of a team are told.
struct HodgkinHuxleyPopulation::Work {
  HodgkinHuxleyPopulation* self;
  WorkerTeam* team;
  int parts;
  int steps;
  const std::uint8_t* frozen;
  std::chrono::nanoseconds start;
  SpikeBuffer* spikes;

  void do_part(int part) const noexcept {
    const Parameters& p = self->parameters_;
    const std::size_t blocks = (self->size() + kNeuronBlock - 1) / kNeuronBlock;
    const auto border = [&](int index) {
      const std::size_t block =
          blocks * static_cast<std::size_t>(index) / static_cast<std::size_t>(parts);
      return std::min(block * kNeuronBlock, self->size());
    };
    Part* const own = part == 0 ? nullptr : &self->parts_[static_cast<std::size_t>(part - 1)];
    EventRecorder recorder(own == nullptr ? *spikes : own->spikes,
                           own == nullptr ? self->resets_ : own->resets);
    recorder.begin(start, p.step, p.neuron.spike_threshold_mV, p.patch);
    const auto barrier = [](void* context) noexcept {
      static_cast<WorkerTeam*>(context)->barrier();
    };
    std::visit(
        [&](auto& membranes) {
          membranes.step(border(part), border(part + 1), steps, frozen, recorder,
                         parts > 1 ? +barrier : nullptr, team);
        },
        self->membranes_);
  }
};

void HodgkinHuxleyPopulation::run(int parts, int steps, const std::uint8_t* frozen,
                                  std::chrono::nanoseconds start, SpikeBuffer& spikes,
                                  WorkerTeam* team) noexcept {
  Work work{this, team, parts, steps, frozen, start, &spikes};
  if (parts == 1) {
    work.do_part(0);
    return;
  }
  for (Part& part : parts_) {
    part.spikes.clear();
    part.resets.clear();
  }
  team->run(
      parts,
      [](void* context, int part) noexcept { static_cast<const Work*>(context)->do_part(part); },
      &work);
  for (const Part& part : parts_) {
    for (const SpikeEvent& spike : part.spikes.events()) spikes.push(spike);
    for (const SpikeEvent& reset : part.resets.events()) resets_.push(reset);
  }
}

}  // namespace merkel
