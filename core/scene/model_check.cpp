#include "core/scene/model_check.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>

#include "core/contact/surface_map.hpp"
#include "core/scene/model_fields.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

Expected<void, ParameterError> check_neuron(const TactileModel::Parameters& p) {
  ParameterCheck all;
  const bool fields = std::any_of(p.patches.begin(), p.patches.end(), [](const auto& patch) {
    return patch.layout == ReceptorLayout::kFields;
  });
  if (const auto* const paper = std::get_if<HodgkinHuxleyAfferent>(&p.afferent)) {
    return all.also(paper->neuron.check())
        .require(!fields || p.network.gain == 0.0, "network.gain",
                 "must be 0 if afferents have their own receptive fields: the network couples the "
                 "neurons of neighbouring subregions")
        .result();
  }
  if (const auto* const integrate = std::get_if<IntegrateAndFireAfferent>(&p.afferent)) {
    all.also(integrate->neuron.check(p.step));
  } else {
    const auto& connor = std::get<ConnorStevensAfferent>(p.afferent);
    all.also(connor.neuron.check())
        .require(p.step >= std::chrono::microseconds{1} && p.step <= std::chrono::microseconds{100},
                 "neuron.step_us", "must be from 1 to 100 for neuron.kind \"connor_stevens\"");
  }
  return all.also(p.adaptation.check())
      .require(p.network.gain == 0.0, "network.gain",
               "must be 0 for this neuron.kind: only \"hodgkin_huxley\" neurons are coupled")
      .result();
}

bool alone_on_patch(const TactileModel::Parameters& p, std::size_t patch) {
  return std::count_if(p.indenters.begin(), p.indenters.end(),
                       [patch](const Indenter& indenter) { return indenter.patch == patch; }) == 1;
}

constexpr double kSmallestStep_ms = 1e-4;
constexpr std::int64_t kMostStepsPerTick = 100'000;

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

}  // namespace

Expected<void, ParameterError> check(const TactileModel::Parameters& p) {
  TactileModel::Parameters copy = p;
  ParameterCheck all;
  all.also(p.skin.check())
      .also(p.transduction.check())
      .also(p.network.check())
      .fields(p.accuracy)
      .require(!p.patches.empty(), "patch", "is missing: a scene needs at least one patch of skin")
      .require(!p.indenters.empty(), "probe", "is missing: a scene needs at least one probe")
      .fields(tick_fields(copy))
      .fields(neuron_fields(copy));
  for (const auto& patch : p.patches) all.also(patch.patch.check());
  for (const Indenter& indenter : p.indenters) {
    all.also(indenter.check(p.skin))
        .require(indenter.patch < p.patches.size(), "probe.patch", "is not a patch of the scene")
        .require(indenter.control == p.indenters.front().control ||
                     p.indenters.front().prescribed() || indenter.prescribed(),
                 "probe.control", kMixedControl)
        .require(!indenter.prescribed() || alone_on_patch(p, indenter.patch), "probe.tip",
                 "\"taxels\" needs a patch of its own: give the other probe another patch")
        .require(!indenter.prescribed() || p.energy_driven(), "probe.tip",
                 "\"taxels\" needs neurons that the energy density drives: set neuron.kind = "
                 "\"integrate_and_fire\" or \"connor_stevens\", or preset = \"goodwin\"")
        .require(!indenter.surface.slides || p.tick >= std::chrono::milliseconds(1) ||
                     SlidingPlan::of(indenter, p.skin, p.tick).has_value(),
                 "loop.tick_us", "is too short for the contact of a surface: set 1000 or more")
        .require(!indenter.surface.slides || alone_on_patch(p, indenter.patch), "probe.surface",
                 "must press alone on its patch: give the other probe a patch of its own");
  }
  if (const auto checked = all.result(); !checked) return checked;
  return ParameterCheck()
      .also(check_neuron(p))
      .require(p.tick.count() % p.step.count() == 0, "neuron.step_us",
               "must divide loop.tick_us without remainder")
      .require(p.tick / p.step <= kMostStepsPerTick, "neuron.step_us",
               "must be at least 1/100000 of loop.tick_us")
      .result();
}

Expected<void, ParameterError> check_step(const TactileModel::Parameters& p,
                                          const std::optional<LatticeCoupling>& network) {
  const auto& afferent = std::get<HodgkinHuxleyAfferent>(p.afferent);
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

}  // namespace merkel
