#include "core/scene/tactile_patch.hpp"

#include <algorithm>

namespace merkel {

TactilePatch::TactilePatch(std::span<const Receptor> receptors, std::size_t neurons,
                           const ReceptorDrive::Parameters& drive,
                           const HodgkinHuxleyPopulation::Parameters& population,
                           const std::optional<LatticeCoupling>& network, std::size_t most_spikes)
    : drive_(receptors, neurons, drive),
      population_(population, neurons, network),
      current_begin_(neurons),
      spikes_(most_spikes) {}

void TactilePatch::reset() noexcept {
  population_.reset();
  static_cast<void>(drive_.compute({}));
  std::fill(current_begin_.begin(), current_begin_.end(), 0.0);
  spikes_.clear();
  asleep_ = false;
}

std::span<const SpikeEvent> TactilePatch::resets() const noexcept {
  if (asleep_) return {};
  return population_.resets();
}

void TactilePatch::step(std::span<const PlacedContact> contacts, int steps,
                        std::chrono::nanoseconds start, WorkerTeam* team) noexcept {
  spikes_.clear();
  const std::span<const double> before = drive_.current_uA_per_cm2();
  std::copy(before.begin(), before.end(), current_begin_.begin());
  const bool changed = drive_.compute(contacts);
  // The currents before this step ran on to `before`: they were constant if they were at rest.
  asleep_ = !changed && population_.all_resting();
  if (asleep_) return;
  population_.advance(current_begin_, drive_.current_uA_per_cm2(), steps, start, spikes_, team);
  spikes_.sort();
}

}  // namespace merkel
