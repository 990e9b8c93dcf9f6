#include "core/scene/afferents.hpp"

#include <algorithm>
#include <utility>

#include "core/neurons/hodgkin_huxley/hodgkin_huxley_group.hpp"
#include "core/neurons/integrate_and_fire/integrate_and_fire_group.hpp"
#include "core/scene/model_check.hpp"

namespace merkel {
namespace {

/// Whether resting neurons are skipped. The neurons of a patch without a probe never get an input,
/// so stepping them would show nothing.
bool freezes(const ModelParameters& p, std::size_t patch) {
  return p.accuracy.freeze_resting ||
         std::none_of(p.indenters.begin(), p.indenters.end(),
                      [patch](const Indenter& indenter) { return indenter.patch == patch; });
}

using Made = Expected<std::unique_ptr<NeuronGroup>, ParameterError>;

Made make_group(const ModelParameters& p, const HodgkinHuxleyAfferent& afferent, std::size_t index,
                std::size_t neurons, std::uint32_t first_neuron, const AfferentTables& tables) {
  std::optional<LatticeCoupling> network;
  if (p.network.gain > 0.0) {
    NetworkParameters own = p.network;
    own.seed += index;
    const Patch& patch = p.patches[index].patch;
    auto coupling = LatticeCoupling::create(own, patch.columns, patch.rows);
    if (!coupling) return Unexpected<ParameterError>(coupling.error());
    network = std::move(*coupling);
  }
  if (const auto checked = check_step(p, network); !checked) {
    return Unexpected<ParameterError>(checked.error());
  }
  return std::make_unique<HodgkinHuxleyGroup>(
      HodgkinHuxleyGroup::Parameters{.neuron = afferent.neuron,
                                     .method = afferent.method,
                                     .precision = afferent.precision,
                                     .step = p.step,
                                     .patch = static_cast<std::uint16_t>(index),
                                     .first_neuron = first_neuron,
                                     .freeze_resting = freezes(p, index),
                                     .resting_states = tables.resting_states},
      neurons, network);
}

std::unique_ptr<NeuronGroup> make_group(const ModelParameters& p,
                                        const IntegrateAndFireAfferent& afferent, std::size_t index,
                                        std::size_t neurons, std::uint32_t first_neuron) {
  IntegrateAndFireGroup::Parameters own{.neuron = afferent.neuron,
                                        .step = p.step,
                                        .patch = static_cast<std::uint16_t>(index),
                                        .first_neuron = first_neuron};
  own.neuron.noise.seed += index;
  return std::make_unique<IntegrateAndFireGroup>(own, neurons);
}

ConnorStevensGroup::Parameters group_of(const ModelParameters& p,
                                        const ConnorStevensAfferent& afferent,
                                        const RateCurrentTable& table) {
  return {.neuron = afferent.neuron,
          .step = p.step,
          .holding_current_uA_per_cm2 = table.current_uA_per_cm2(0.0),
          .full_noise_current_uA_per_cm2 =
              table.current_uA_per_cm2(afferent.neuron.noise.full_drive_Hz)};
}

std::unique_ptr<NeuronGroup> make_group(const ModelParameters& p,
                                        const ConnorStevensAfferent& afferent, std::size_t index,
                                        std::size_t neurons, std::uint32_t first_neuron,
                                        const AfferentTables& tables) {
  ConnorStevensGroup::Parameters own = group_of(p, afferent, *tables.rate_current);
  own.patch = static_cast<std::uint16_t>(index);
  own.first_neuron = first_neuron;
  own.rest = tables.rest;
  own.neuron.noise.seed += index;
  return std::make_unique<ConnorStevensGroup>(own, neurons);
}

}  // namespace

Expected<AfferentTables, ParameterError> afferent_tables_of(const ModelParameters& parameters) {
  AfferentTables tables;
  if (const auto* const paper = std::get_if<HodgkinHuxleyAfferent>(&parameters.afferent)) {
    bool frozen = false;
    for (std::size_t i = 0; i < parameters.patches.size(); ++i) {
      frozen = frozen || freezes(parameters, i);
    }
    if (frozen) {
      tables.resting_states = std::make_shared<const RestingStates>(paper->neuron);
    }
    return tables;
  }
  const auto* const connor = std::get_if<ConnorStevensAfferent>(&parameters.afferent);
  if (connor == nullptr) return tables;
  const auto table = std::make_shared<const RateCurrentTable>(connor->neuron, parameters.step);
  if (!table->valid()) {
    return Unexpected<ParameterError>(
        {.key = "neuron.kind",
         .reason = "is \"connor_stevens\" with conductances at which it never fires steadily: "
                   "change g_Na, g_K, g_A or g_L"});
  }
  tables.rate_current = table;
  tables.rest = ConnorStevensGroup::rest_of(group_of(parameters, *connor, *table));
  return tables;
}

Expected<Afferents, ParameterError> Afferents::create(const ModelParameters& parameters,
                                                      std::size_t patch, std::size_t neurons,
                                                      const AfferentTables& tables,
                                                      std::uint32_t first_neuron) {
  if (const auto* const paper = std::get_if<HodgkinHuxleyAfferent>(&parameters.afferent)) {
    Made group = make_group(parameters, *paper, patch, neurons, first_neuron, tables);
    if (!group) return Unexpected<ParameterError>(group.error());
    return Afferents(std::move(*group), std::nullopt);
  }
  AdaptationStage stage{.adaptation = parameters.adaptation, .table = tables.rate_current};
  stage.adaptation.seed += patch;
  if (const auto* const connor = std::get_if<ConnorStevensAfferent>(&parameters.afferent)) {
    stage.compression_ms = connor->compression_ms;
    return Afferents(make_group(parameters, *connor, patch, neurons, first_neuron, tables), stage);
  }
  const auto& integrate = std::get<IntegrateAndFireAfferent>(parameters.afferent);
  return Afferents(make_group(parameters, integrate, patch, neurons, first_neuron), stage);
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
