#include "core/scene/tactile_patch.hpp"

#include <algorithm>

namespace merkel {

void TactilePatch::reset() noexcept {
  afferents_.reset();
  static_cast<void>(drive_.compute({}));
  std::fill(drive_begin_.begin(), drive_begin_.end(), 0.0);
  spikes_.clear();
  asleep_ = false;
}

std::span<const SpikeEvent> TactilePatch::resets() const noexcept {
  return asleep_ ? std::span<const SpikeEvent>{} : afferents_.neurons().resets();
}

void TactilePatch::step(std::span<const PlacedContact> contacts, int steps,
                        std::chrono::nanoseconds start, WorkerTeam* team) noexcept {
  spikes_.clear();
  const std::span<const double> before = drive_.output();
  std::copy(before.begin(), before.end(), drive_begin_.begin());
  const bool changed = drive_.compute(contacts);
  // If the neurons were at rest, the input of the previous step was constant.
  asleep_ = !changed && afferents_.all_resting();
  if (asleep_) return;
  afferents_.advance(drive_begin_, drive_.output(), steps, start, spikes_, team);
  spikes_.sort();
}

NeuronSample TactilePatch::neuron(std::size_t neuron) const noexcept {
  return {.drive = static_cast<float>(afferents_.drive(neuron, drive_.output()[neuron])),
          .potential = static_cast<float>(afferents_.neurons().potential(neuron))};
}

std::size_t TactilePatch::active_neurons() const noexcept {
  return asleep_ ? 0 : afferents_.neurons().active_neurons();
}

}  // namespace merkel
