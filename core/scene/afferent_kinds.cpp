#include "core/scene/afferent_kinds.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/neurons/connor_stevens/connor_stevens_group.hpp"
#include "core/neurons/hodgkin_huxley/hodgkin_huxley_group.hpp"
#include "core/neurons/integrate_and_fire/integrate_and_fire_group.hpp"
#include "core/scene/afferents.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

/// Whether resting neurons are skipped. The neurons of a patch without a probe never get an input,
/// so stepping them would show nothing.
bool freezes(const ModelParameters& p, std::size_t patch) {
  return p.accuracy.freeze_resting ||
         std::none_of(p.indenters.begin(), p.indenters.end(),
                      [patch](const Indenter& indenter) { return indenter.patch == patch; });
}

constexpr double kSmallestStep_ms = 1e-4;

/// The largest step that divides the tick and does not exceed a bound, as the shortest decimal in
/// µs.
std::string step_below(double bound_ms, std::chrono::nanoseconds tick) {
  std::int64_t parts = 1;
  while (tick.count() % parts != 0 ||
         units::ms_from(tick) > bound_ms * static_cast<double>(parts)) {
    ++parts;
  }
  return shortest_decimal(units::us_from(tick / parts));
}

/// Rejects a step at which the method would diverge or give wrong spike counts.
Expected<void, ParameterError> check_step(const HodgkinHuxleyAfferent& afferent,
                                          const ModelParameters& p,
                                          const std::optional<LatticeCoupling>& network) {
  const double exchange_per_ms =
      network ? network->largest_conductance() / afferent.neuron.capacitance_uF_per_cm2 : 0.0;
  const double bound_ms = largest_step_ms(afferent.method, exchange_per_ms);
  if (units::ms_from(p.step) <= bound_ms) return {};
  const std::string given = shortest_decimal(units::us_from(p.step));
  const std::string bound = shortest_decimal(std::floor(1e4 * bound_ms + 1e-6) / 10.0);
  const std::string method(name_of(afferent.method));
  if (bound_ms < kSmallestStep_ms) {
    return Unexpected<ParameterError>(
        {.key = "network.gain",
         .reason = "couples the neurons so strongly that no step is small enough: reduce it"});
  }
  return Unexpected<ParameterError>({.key = "neuron.step_us",
                                     .reason = "must be at most " + bound + " for " + method +
                                               (network ? " in this network" : "") + ", but is " +
                                               given + ": use " + step_below(bound_ms, p.tick)});
}

/// The stage of adaptation of a patch's afferents.
Afferents::AdaptationStage stage_of(const ModelParameters& p, std::size_t patch) {
  Afferents::AdaptationStage stage{.adaptation = p.adaptation};
  stage.adaptation.seed += patch;
  return stage;
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

}  // namespace

void set_kind(ModelParameters& model, NeuronKind kind) {
  const auto make = [&]<std::size_t... I>(std::index_sequence<I...>) {
    const auto one = [&]<class Kind>(Kind afferent) {
      model.step = Kind::kDefaultStep;
      model.afferent = std::move(afferent);
    };
    ((static_cast<std::size_t>(kind) == I ? one(std::variant_alternative_t<I, AfferentParameters>{})
                                          : void()),
     ...);
  };
  make(std::make_index_sequence<std::variant_size_v<AfferentParameters>>());
}

// Hodgkin-Huxley

FieldTable HodgkinHuxleyAfferent::fields() {
  using Q = HodgkinHuxleyAfferent;
  static constexpr Field kFields[] = {
      {"method", "", one_of(kIntegrationMethods), "integration method", at<&Q::method>},
      {"precision", "", one_of(kPrecisions), "floating-point precision", at<&Q::precision>}};
  return {"neuron", kFields};
}

void HodgkinHuxleyAfferent::bind(BoundFields& fields) {
  bind_fields(*this, fields);
  bind_fields(neuron, fields);
}

Expected<void, ParameterError> HodgkinHuxleyAfferent::check(const ModelParameters& model) const {
  const bool own_fields = std::any_of(
      model.patches.begin(), model.patches.end(),
      [](const PatchParameters& patch) { return patch.layout == ReceptorLayout::kFields; });
  return ParameterCheck()
      .also(neuron.check())
      .require(!own_fields || model.network.gain == 0.0, "network.gain",
               "must be 0 if afferents have their own receptive fields: the network couples the "
               "neurons of neighbouring subregions")
      .result();
}

Expected<AfferentTables, ParameterError> HodgkinHuxleyAfferent::tables(
    const ModelParameters& model) const {
  AfferentTables tables;
  for (std::size_t i = 0; i < model.patches.size() && !tables.resting_states; ++i) {
    if (freezes(model, i)) tables.resting_states = std::make_shared<const RestingStates>(neuron);
  }
  return tables;
}

Expected<Afferents, ParameterError> HodgkinHuxleyAfferent::afferents(
    const ModelParameters& model, std::size_t patch, std::size_t neurons,
    std::uint32_t first_neuron, const AfferentTables& tables) const {
  std::optional<LatticeCoupling> network;
  if (model.network.gain > 0.0) {
    NetworkParameters own = model.network;
    own.seed += patch;
    const Patch& lattice = model.patches[patch].patch;
    auto coupling = LatticeCoupling::create(own, lattice.columns, lattice.rows);
    if (!coupling) return Unexpected<ParameterError>(coupling.error());
    network = std::move(*coupling);
  }
  if (const auto checked = check_step(*this, model, network); !checked) {
    return Unexpected<ParameterError>(checked.error());
  }
  return Afferents(std::make_unique<HodgkinHuxleyGroup>(
                       HodgkinHuxleyGroup::Parameters{.neuron = neuron,
                                                      .method = method,
                                                      .precision = precision,
                                                      .step = model.step,
                                                      .patch = static_cast<std::uint16_t>(patch),
                                                      .first_neuron = first_neuron,
                                                      .freeze_resting = freezes(model, patch),
                                                      .resting_states = tables.resting_states},
                       neurons, network),
                   std::nullopt);
}

// Integrate-and-fire

void IntegrateAndFireAfferent::bind(BoundFields& fields) { bind_fields(neuron, fields); }

Expected<void, ParameterError> IntegrateAndFireAfferent::check(const ModelParameters& model) const {
  return neuron.check(model.step);
}

Expected<AfferentTables, ParameterError> IntegrateAndFireAfferent::tables(
    const ModelParameters& /*model*/) const {
  return AfferentTables{};
}

Expected<Afferents, ParameterError> IntegrateAndFireAfferent::afferents(
    const ModelParameters& model, std::size_t patch, std::size_t neurons,
    std::uint32_t first_neuron, const AfferentTables& /*tables*/) const {
  IntegrateAndFireGroup::Parameters own{.neuron = neuron,
                                        .step = model.step,
                                        .patch = static_cast<std::uint16_t>(patch),
                                        .first_neuron = first_neuron};
  own.neuron.noise.seed += patch;
  return Afferents(std::make_unique<IntegrateAndFireGroup>(own, neurons), stage_of(model, patch));
}

// Connor-Stevens

FieldTable ConnorStevensAfferent::fields() {
  static constexpr Field kFields[] = {
      {"compression_ms", "ms", not_negative(1e6),
       "compresses strong drives like a refractory period of this length",
       at<&ConnorStevensAfferent::compression_ms>, "", true}};
  return {"neuron", kFields};
}

void ConnorStevensAfferent::bind(BoundFields& fields) {
  bind_fields(*this, fields);
  bind_fields(neuron, fields);
}

Expected<void, ParameterError> ConnorStevensAfferent::check(const ModelParameters& model) const {
  using std::chrono::microseconds;
  return ParameterCheck()
      .also(neuron.check())
      .require(model.step >= microseconds{1} && model.step <= microseconds{100}, "neuron.step_us",
               "must be from 1 to 100 for neuron.kind \"connor_stevens\"")
      .result();
}

Expected<AfferentTables, ParameterError> ConnorStevensAfferent::tables(
    const ModelParameters& model) const {
  const auto table = std::make_shared<const RateCurrentTable>(neuron, model.step);
  if (!table->valid()) {
    return Unexpected<ParameterError>(
        {.key = "neuron.kind",
         .reason = "is \"connor_stevens\" with conductances at which it never fires steadily: "
                   "change g_Na, g_K, g_A or g_L"});
  }
  return AfferentTables{.rate_current = table,
                        .rest = ConnorStevensGroup::rest_of(group_of(model, *this, *table)),
                        .resting_states = nullptr};
}

Expected<Afferents, ParameterError> ConnorStevensAfferent::afferents(
    const ModelParameters& model, std::size_t patch, std::size_t neurons,
    std::uint32_t first_neuron, const AfferentTables& tables) const {
  ConnorStevensGroup::Parameters own = group_of(model, *this, *tables.rate_current);
  own.patch = static_cast<std::uint16_t>(patch);
  own.first_neuron = first_neuron;
  own.rest = tables.rest;
  own.neuron.noise.seed += patch;
  Afferents::AdaptationStage stage = stage_of(model, patch);
  stage.table = tables.rate_current;
  stage.compression_ms = compression_ms;
  return Afferents(std::make_unique<ConnorStevensGroup>(own, neurons), stage);
}

}  // namespace merkel
