#include "core/scene/afferents.hpp"

#include <algorithm>
#include <utility>

namespace merkel {

AfferentTables afferent_tables_of(const ModelParameters& parameters) {
  return std::visit([&](const auto& afferent) { return afferent.tables(parameters); },
                    parameters.afferent);
}

Expected<Afferents, ParameterError> Afferents::create(const ModelParameters& parameters,
                                                      std::size_t patch, std::size_t neurons,
                                                      const AfferentTables& tables,
                                                      std::uint32_t first_neuron) {
  return std::visit(
      [&](const auto& afferent) {
        return afferent.afferents(parameters, patch, neurons, first_neuron, tables);
      },
      parameters.afferent);
}

Afferents::Afferents(std::unique_ptr<NeuronGroup> neurons,
                     const std::optional<AdaptationParameters>& adaptation)
    : neurons_(std::move(neurons)) {
  if (!adaptation) return;
  adaptation_.emplace(*adaptation, neurons_->size());
  drive_Hz_.resize(neurons_->size());
  last_drive_Hz_.resize(neurons_->size());
}

void Afferents::reset() noexcept {
  neurons_->reset();
  if (!adaptation_) return;
  adaptation_->reset();
  std::fill(drive_Hz_.begin(), drive_Hz_.end(), 0.0);
}

void Afferents::advance(std::span<const double> input_begin, std::span<const double> input_end,
                        int steps, std::chrono::nanoseconds start, SpikeBuffer& spikes,
                        WorkerTeam* team) noexcept {
  if (adaptation_) {
    last_drive_Hz_.swap(drive_Hz_);
    adaptation_->advance(input_begin, input_end, steps * neurons_->step(), drive_Hz_);
    input_begin = last_drive_Hz_;
    input_end = drive_Hz_;
  }
  neurons_->advance(input_begin, input_end, steps, start, spikes, team);
}

}  // namespace merkel
