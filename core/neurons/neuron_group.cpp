#include "core/neurons/neuron_group.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace merkel {
namespace {

/// Converts the events of a kernel call into spike events.
class SpikeRecorder final : public StepObserver {
 public:
  SpikeRecorder(std::chrono::nanoseconds start, std::chrono::nanoseconds step, std::uint16_t patch,
                std::uint32_t first_neuron, SpikeBuffer& spikes, SpikeBuffer& resets)
      : start_(start),
        step_(step),
        patch_(patch),
        first_neuron_(first_neuron),
        spikes_(spikes),
        resets_(resets) {}

  void spiked(std::size_t neuron, int step, double fraction) noexcept override {
    spikes_.push(event(neuron, step, fraction));
  }
  void reset(std::size_t neuron, int step) noexcept override {
    resets_.push(event(neuron, step, 1.0));
  }

 private:
  [[nodiscard]] SpikeEvent event(std::size_t neuron, int number, double fraction) const noexcept {
    const double within_ns = fraction * static_cast<double>(step_.count());
    return {.time = start_ + number * step_ + std::chrono::nanoseconds{std::llround(within_ns)},
            .neuron = first_neuron_ + static_cast<std::uint32_t>(neuron),
            .patch = patch_,
            .flags = 0};
  }

  std::chrono::nanoseconds start_;
  std::chrono::nanoseconds step_;
  std::uint16_t patch_;
  std::uint32_t first_neuron_;
  SpikeBuffer& spikes_;
  SpikeBuffer& resets_;
};

/// Divides the neurons among the threads of a team in whole blocks, if there are enough neurons.
/// Calls step(first, last, peers) for each part; peers is null for a single part.
template <class Step>
void share_neurons(std::size_t neurons, WorkerTeam* team, Step step) noexcept MERKEL_REALTIME {
  /// With fewer neurons per part, sharing the work costs more than it saves.
  constexpr std::size_t kMinPart = 1024;
  const std::size_t worth = std::max<std::size_t>(neurons / kMinPart, 1);
  const int parts = team == nullptr
                        ? 1
                        : static_cast<int>(std::min(worth, static_cast<std::size_t>(team->size())));
  if (parts == 1) {
    step(std::size_t{0}, neurons, static_cast<WorkerTeam*>(nullptr));
    return;
  }
  struct Work {
    std::size_t neurons;
    int parts;
    WorkerTeam* team;
    Step& step;

    [[nodiscard]] std::size_t border(int part) const noexcept {
      const std::size_t block =
          blocks_of(neurons) * static_cast<std::size_t>(part) / static_cast<std::size_t>(parts);
      return std::min(block * kNeuronBlock, neurons);
    }
  } work{neurons, parts, team, step};
  team->run(
      parts,
      [](void* context, int part) noexcept {
        const Work& w = *static_cast<const Work*>(context);
        w.step(w.border(part), w.border(part + 1), w.team);
      },
      &work);
}

}  // namespace

NeuronGroup::NeuronGroup(std::size_t neurons, std::chrono::nanoseconds step, std::uint16_t patch,
                         std::uint32_t first_neuron)
    : neurons_(neurons),
      step_(step),
      patch_(patch),
      first_neuron_(first_neuron),
      resets_(neurons) {}

std::size_t NeuronGroup::active_neurons() const noexcept {
  return size() - std::min(size(), resting_blocks_ * kNeuronBlock);
}

void NeuronGroup::reset() noexcept {
  set_at_rest();
  steps_taken_ = 0;
  resting_blocks_ = 0;
  resets_.clear();
}

void NeuronGroup::advance(std::span<const double> input_begin, std::span<const double> input_end,
                          int steps, std::chrono::nanoseconds start, SpikeBuffer& spikes,
                          WorkerTeam* team) noexcept {
  assert(input_begin.size() == size() && input_end.size() == size());
  resting_blocks_ = take_input(input_begin, input_end);
  resets_.clear();
  share_neurons(neurons_, team,
                [&](std::size_t first, std::size_t last, WorkerTeam* peers) noexcept {
                  SpikeRecorder recorder(start, step_, patch_, first_neuron_, spikes, resets_);
                  step_part({.first = first,
                             .last = last,
                             .steps = steps,
                             .steps_before = steps_taken_,
                             .observer = &recorder,
                             .peers = peers});
                });
  steps_taken_ += static_cast<std::uint64_t>(steps);
}

}  // namespace merkel
