#include "core/scene/energy_driven_neurons.hpp"

#include <algorithm>

namespace merkel {

EnergyDrivenNeurons::Population EnergyDrivenNeurons::make_population(const Parameters& parameters,
                                                                     std::size_t neurons) {
  if (const auto* const integrate =
          std::get_if<IntegrateAndFirePopulation::Parameters>(&parameters.neurons)) {
    return Population(std::in_place_type<IntegrateAndFirePopulation>, *integrate, neurons);
  }
  const auto& drive = std::get<ConnorStevensDrive>(parameters.neurons);
  ConnorStevensPopulation::Parameters population = drive.population;
  population.holding_current_uA_per_cm2 = drive.table->current_uA_per_cm2(0.0);
  return Population(std::in_place_type<ConnorStevensPopulation>, population, neurons);
}

EnergyDrivenNeurons::EnergyDrivenNeurons(const Parameters& parameters, std::size_t neurons)
    : adaptation_(parameters.adaptation, neurons),
      population_(make_population(parameters, neurons)),
      step_(0),
      drive_(neurons),
      drive_begin_(neurons),
      drive_end_(neurons) {
  if (const auto* const drive = std::get_if<ConnorStevensDrive>(&parameters.neurons)) {
    table_ = drive->table;
    compression_s_ = 1e-3 * drive->compression_ms;
    step_ = drive->population.step;
  } else {
    step_ = std::get<IntegrateAndFirePopulation::Parameters>(parameters.neurons).step;
  }
  std::fill(drive_end_.begin(), drive_end_.end(), resting_input());
}

double EnergyDrivenNeurons::resting_input() const noexcept {
  return table_ ? table_->current_uA_per_cm2(0.0) : 0.0;
}

void EnergyDrivenNeurons::reset() noexcept {
  adaptation_.reset();
  std::visit([](auto& population) { population.reset(); }, population_);
  std::fill(drive_.begin(), drive_.end(), 0.0);
  std::fill(drive_end_.begin(), drive_end_.end(), resting_input());
}

void EnergyDrivenNeurons::advance(std::span<const double> energy_begin,
                                  std::span<const double> energy_end, int steps,
                                  std::chrono::nanoseconds start, SpikeBuffer& spikes,
                                  WorkerTeam* team) noexcept {
  drive_begin_.swap(drive_end_);
  adaptation_.advance(energy_begin, energy_end, steps * step_, drive_);
  for (std::size_t n = 0; n < drive_.size(); ++n) {
    drive_end_[n] = table_
                        ? table_->current_uA_per_cm2(drive_[n] / (1.0 + compression_s_ * drive_[n]))
                        : drive_[n];
  }
  std::visit(
      [&](auto& population) {
        population.advance(drive_begin_, drive_end_, steps, start, spikes, team);
      },
      population_);
}

}  // namespace merkel
