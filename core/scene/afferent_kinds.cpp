#include "core/scene/afferent_kinds.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/neurons/hodgkin_huxley/hodgkin_huxley_group.hpp"
#include "core/neurons/hodgkin_huxley/largest_step.hpp"
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
                                          const ModelParameters& p, double alone_ms,
                                          const std::optional<LatticeCoupling>& network) {
  const double exchange_per_ms =
      network ? network->largest_conductance() / afferent.neuron.capacitance_uF_per_cm2 : 0.0;
  const double bound_ms = largest_step_ms(afferent.method, alone_ms, exchange_per_ms);
  if (units::ms_from(p.step) <= bound_ms) return {};
  const std::string given = shortest_decimal(units::us_from(p.step));
  const std::string bound = shortest_decimal(std::floor(1e4 * bound_ms + 1e-6) / 10.0);
  const std::string method(name_of(afferent.method));
  if (alone_ms < kSmallestStep_ms) {
    return Unexpected<ParameterError>(
        {.key = "neuron.method",
         .reason = "gives wrong spikes at any step for a neuron with these conductances and "
                   "potentials: take them nearer to the published ones, or another method"});
  }
  if (bound_ms < kSmallestStep_ms) {
    return Unexpected<ParameterError>(
        {.key = "network.gain",
         .reason = "couples the neurons so strongly that no step is small enough: reduce it"});
  }
  return Unexpected<ParameterError>(
      {.key = "neuron.step_us",
       .reason =
           "must be at most " + bound + " for " + method + (network ? " in this network" : "") +
           (afferent.neuron == HodgkinHuxley{} ? "" : " with these conductances and potentials") +
           ", but is " + given + ": use " + step_below(bound_ms, p.tick)});
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

AfferentTables HodgkinHuxleyAfferent::tables(const ModelParameters& model) const {
  AfferentTables tables{.resting_states = {},
                        .largest_step_alone_ms = largest_step_alone_ms(neuron, method)};
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
  if (const auto checked = check_step(*this, model, tables.largest_step_alone_ms, network);
      !checked) {
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

AfferentTables IntegrateAndFireAfferent::tables(const ModelParameters& /*model*/) const {
  return {};
}

Expected<Afferents, ParameterError> IntegrateAndFireAfferent::afferents(
    const ModelParameters& model, std::size_t patch, std::size_t neurons,
    std::uint32_t first_neuron, const AfferentTables& /*tables*/) const {
  IntegrateAndFireGroup::Parameters own{.neuron = neuron,
                                        .step = model.step,
                                        .patch = static_cast<std::uint16_t>(patch),
                                        .first_neuron = first_neuron};
  own.neuron.noise.seed += patch;
  AdaptationParameters adaptation = model.adaptation;
  adaptation.seed += patch;
  return Afferents(std::make_unique<IntegrateAndFireGroup>(own, neurons), adaptation);
}

}  // namespace merkel
