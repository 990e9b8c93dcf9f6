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
  all.also(std::visit([&](const auto& afferent) { return afferent.check(p); }, p.afferent));
  if (!p.energy_driven()) return all.result();
  return all.also(p.adaptation.check())
      .require(p.network.gain == 0.0, "network.gain",
               "must be 0 for this neuron.kind: only \"hodgkin_huxley\" neurons are coupled")
      .result();
}

bool alone_on_patch(const TactileModel::Parameters& p, std::size_t patch) {
  return std::count_if(p.indenters.begin(), p.indenters.end(),
                       [patch](const Indenter& indenter) { return indenter.patch == patch; }) == 1;
}

constexpr std::int64_t kMaxStepsPerTick = 100'000;

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
  // The checks of a tip build it, on a skin whose numbers are in their ranges.
  if (const auto checked = all.result(); !checked) return checked;
  for (const Indenter& indenter : p.indenters) {
    if (const auto checked = all.also(indenter.check(p.skin)).result(); !checked) return checked;
    all.require(indenter.patch < p.patches.size(), "probe.patch", "is not a patch of the scene")
        .require(indenter.control == p.indenters.front().control ||
                     p.indenters.front().taxels() != nullptr || indenter.taxels() != nullptr,
                 "probe.control", kMixedControl)
        .require(indenter.taxels() == nullptr || alone_on_patch(p, indenter.patch), "probe.tip",
                 "\"taxels\" needs a patch of its own: give the other probe another patch")
        .require(indenter.taxels() == nullptr || p.energy_driven(), "probe.tip",
                 "\"taxels\" needs neurons that the energy density drives: set neuron.kind = "
                 "\"integrate_and_fire\", or preset = \"goodwin\"")
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
      .require(p.tick / p.step <= kMaxStepsPerTick, "neuron.step_us",
               "must be at least 1/100000 of loop.tick_us")
      .result();
}

}  // namespace merkel
