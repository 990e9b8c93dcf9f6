#include "core/scene/afferents.hpp"

#include <algorithm>
#include <utility>

namespace merkel {
Expected<AfferentTables, ParameterError> afferent_tables_of(const ModelParameters& parameters) {
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
                     const std::optional<AdaptationStage>& stage)
    : neurons_(std::move(neurons)) {
  if (!stage) return;
  const std::size_t count = neurons_->size();
  adaptation_.emplace(stage->adaptation, count);
  table_ = stage->table;
  compression_s_ = 1e-3 * stage->compression_ms;
  drive_Hz_.resize(count);
  begin_.resize(count);
  end_.assign(count, input_of(0.0));
}

double Afferents::input_of(double drive_Hz) const noexcept {
  if (!table_) return drive_Hz;
  return table_->current_uA_per_cm2(drive_Hz / (1.0 + compression_s_ * drive_Hz));
}

void Afferents::reset() noexcept {
  neurons_->reset();
  if (!adaptation_) return;
  adaptation_->reset();
  std::fill(end_.begin(), end_.end(), input_of(0.0));
}

void Afferents::advance(std::span<const double> input_begin, std::span<const double> input_end,
                        int steps, std::chrono::nanoseconds start, SpikeBuffer& spikes,
                        WorkerTeam* team) noexcept {
  if (adaptation_) {
    begin_.swap(end_);
    adaptation_->advance(input_begin, input_end, steps * neurons_->step(), drive_Hz_);
    std::transform(drive_Hz_.begin(), drive_Hz_.end(), end_.begin(),
                   [this](double drive) { return input_of(drive); });
    input_begin = begin_;
    input_end = end_;
  }
  neurons_->advance(input_begin, input_end, steps, start, spikes, team);
}

}  // namespace merkel
