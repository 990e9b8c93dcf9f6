#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/neuron/kernel/membrane_kernel.hpp"
#include "core/neuron/spike_buffer.hpp"
#include "core/realtime_tag.hpp"
#include "core/worker_team.hpp"

namespace merkel {

/// Shares the steps of neurons that do not see one another between the threads of a team: each part
/// steps its own whole blocks and collects its own spikes. Real-time: yes, after construction.
class SharedSteps {
 public:
  /// \param neurons  of the population
  explicit SharedSteps(std::size_t neurons) : neurons_(neurons) {
    if (neurons < 2 * kLeastPart) return;
    parts_.assign(kMostParts - 1, SpikeBuffer(neurons / 2 + kNeuronBlock));
  }

  /// Calls step(first, last, spikes) for the neurons [first, last) of every part.
  template <class Step>
  void run(WorkerTeam* team, SpikeBuffer& spikes, Step step) noexcept MERKEL_REALTIME {
    const int parts = parts_for(team);
    if (parts == 1) {
      step(std::size_t{0}, neurons_, spikes);
      return;
    }
    for (SpikeBuffer& part : parts_) part.clear();
    struct Work {
      SharedSteps* self;
      Step* step;
      SpikeBuffer* spikes;
      int parts;
    } work{this, &step, &spikes, parts};
    team->run(
        parts,
        [](void* context, int part) noexcept {
          const Work& w = *static_cast<const Work*>(context);
          (*w.step)(w.self->border(part, w.parts), w.self->border(part + 1, w.parts),
                    part == 0 ? *w.spikes : w.self->parts_[static_cast<std::size_t>(part - 1)]);
        },
        &work);
    for (int part = 1; part < parts; ++part) {
      for (const SpikeEvent& spike : parts_[static_cast<std::size_t>(part - 1)].events()) {
        spikes.push(spike);
      }
    }
  }

 private:
  static constexpr int kMostParts = 16;
  /// Below so many neurons a part, sharing the work costs more than it saves.
  static constexpr std::size_t kLeastPart = 1024;

  [[nodiscard]] int parts_for(const WorkerTeam* team) const noexcept {
    if (team == nullptr) return 1;
    const int worth = static_cast<int>(
        std::min<std::size_t>(neurons_ / kLeastPart, static_cast<std::size_t>(kMostParts)));
    return std::clamp(worth, 1, std::max(1, team->size()));
  }
  [[nodiscard]] std::size_t border(int part, int parts) const noexcept {
    const std::size_t blocks = (neurons_ + kNeuronBlock - 1) / kNeuronBlock;
    const std::size_t block =
        blocks * static_cast<std::size_t>(part) / static_cast<std::size_t>(parts);
    return std::min(block * kNeuronBlock, neurons_);
  }

  std::size_t neurons_;
  std::vector<SpikeBuffer> parts_;  ///< of all parts but the first, which adds to the caller's
};

}  // namespace merkel
