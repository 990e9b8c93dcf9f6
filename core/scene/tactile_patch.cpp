#include "core/scene/tactile_patch.hpp"

#include <algorithm>

namespace merkel {

TactilePatch::TactilePatch(std::span<const Receptor> receptors, std::size_t neurons,
                           const ReceptorDrive::Parameters& drive,
                           const HodgkinHuxleyPopulation::Parameters& population,
                           const std::optional<LatticeCoupling>& network, std::size_t most_spikes)
    : drive_(receptors, neurons, drive),
      population_(std::in_place_type<HodgkinHuxleyPopulation>, population, neurons, network),
      drive_begin_(neurons),
      spikes_(most_spikes) {}

TactilePatch::TactilePatch(std::span<const Receptor> receptors, std::size_t neurons,
                           const ReceptorDrive::Parameters& drive,
                           const EnergyDrivenNeurons::Parameters& energy_driven,
                           std::size_t most_spikes)
    : drive_(receptors, neurons, drive),
      population_(std::in_place_type<EnergyDrivenNeurons>, energy_driven, neurons),
      drive_begin_(neurons),
      spikes_(most_spikes) {}

void TactilePatch::reset() noexcept {
  std::visit([](auto& population) { population.reset(); }, population_);
  static_cast<void>(drive_.compute({}));
  std::fill(drive_begin_.begin(), drive_begin_.end(), 0.0);
  spikes_.clear();
  asleep_ = false;
}

std::span<const SpikeEvent> TactilePatch::resets() const noexcept {
  if (asleep_) return {};
  return std::visit([](const auto& population) { return population.resets(); }, population_);
}

void TactilePatch::step(std::span<const PlacedContact> contacts, int steps,
                        std::chrono::nanoseconds start, WorkerTeam* team) noexcept {
  spikes_.clear();
  const std::span<const double> before = drive_.current_uA_per_cm2();
  std::copy(before.begin(), before.end(), drive_begin_.begin());
  const bool changed = drive_.compute(contacts);
  // The currents before this step ran on to `before`: they were constant if they were at rest.
  asleep_ = !changed && std::visit([](const auto& population) { return population.all_resting(); },
                                   population_);
  if (asleep_) return;
  std::visit(
      [&](auto& population) {
        population.advance(drive_begin_, drive_.current_uA_per_cm2(), steps, start, spikes_, team);
      },
      population_);
  spikes_.sort();
}

std::size_t TactilePatch::active_neurons() const noexcept {
  if (asleep_) return 0;
  return std::visit([](const auto& population) { return population.active_neurons(); },
                    population_);
}

}  // namespace merkel
