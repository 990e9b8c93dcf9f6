#include "tools/studies/plan/plan_report.hpp"

#include <utility>

#include <fmt/core.h>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "tools/json_text.hpp"
#include "tools/studies/report/report.hpp"

namespace merkel {

std::string name_of_option(const PlanOption& option) {
  return std::string(name_of(option.method)) + " in " + std::string(name_of(option.precision)) +
         " at " + shortest_decimal(units::us_from(option.step)) + " µs";
}

namespace {

/// The neurons with their method and step.
std::string name_of_neurons(const Plan& plan) {
  const std::string step = " neurons at " + shortest_decimal(units::us_from(plan.chosen.step)) +
                           " µs, tick " + shortest_decimal(units::ms_from(plan.chosen.tick)) +
                           " ms";
  if (plan.kind == NeuronKind::kHodgkinHuxley) return name_of_option(plan.chosen);
  return std::string(name_of(plan.kind)) + step;
}

}  // namespace

std::string plan_text(const Plan& plan) {
  std::string text =
      fmt::format("rehearsed {:.3g} s{}: {} neurons, {} receptors, {} spikes\n", plan.rehearsed_s,
                  plan.stand_in ? " with a ramp-and-hold instead of the device" : "", plan.neurons,
                  plan.receptors, plan.spikes);
  if (plan.budget_us) {
    text += fmt::format(
        "spike-time error to meet: {:g} µs (rms), which takes a predicted error of at most {:g} µs\n"
        "tried, for each tick first RK4 with the finest step, then by estimated cost:\n",
        *plan.budget_us, PlanOption::kMargin * *plan.budget_us);
    for (const PlanOption& option : plan.tried) {
      text += fmt::format(
          "  {:<58} {:8.2f} µs per tick, {}{}\n", name_of_option(option), option.tick_us,
          option.measured() ? fmt::format("error {:.3g} µs", option.error_us()) : "error unknown",
          option.error.unmatched > 0 ? fmt::format(", {} unmatched spikes", option.error.unmatched)
                                     : "");
    }
  }
  text += "chosen: " + name_of_neurons(plan) + "\n";
  if (plan.chosen.measured() && units::ms_from(plan.chosen.tick) < plan.scene_tick_ms) {
    text += fmt::format(
        "the tick is shorter than loop.tick_us ({:g} ms): within longer ticks, the currents deviate "
        "too much from linear interpolation for this error limit\n",
        plan.scene_tick_ms);
  }
  text += fmt::format(
      "predicted: {:.2f} µs per tick of {:g} ms ({:.0f} × real time), {}", plan.chosen.tick_us,
      units::ms_from(plan.chosen.tick), units::us_from(plan.chosen.tick) / plan.chosen.tick_us,
      plan.chosen.measured() ? fmt::format("spike-time error {:.3g} µs", plan.chosen.error_us())
                             : "spike-time error unknown: nothing fired in the rehearsal");
  if (plan.chosen.error.unmatched > 0) {
    text += fmt::format(" and {:.1f} % of the spikes unmatched",
                        100.0 * plan.chosen.error.share_unmatched());
  }
  text += "\n";
  if (!plan.chosen.measured() && plan.budget_us) {
    text +=
        "the most accurate method and the shortest tick are taken: plan with a press at which "
        "afferents fire to find a faster method that meets the limit\n";
  }
  if (plan.electrodes > 0) {
    text += fmt::format("stimulation commands for {} electrode{}: additional {:.2f} µs per tick\n",
                        plan.electrodes, plan.electrodes == 1 ? "" : "s", plan.encoding_us);
  }
  text += "skipped:\n";
  for (const std::string& sentence : plan.skipped) text += "  " + sentence + "\n";
  for (std::size_t i = 0; i < plan.validity.size(); ++i) {
    text += fmt::format("contact law of probe {}: {}\n", i + 1, plan.validity[i]);
  }
  return text;
}

std::string plan_json(const Plan& plan) {
  const auto option_json = [](const PlanOption& option) {
    return Json{{"method", name_of(option.method)},
                {"precision", name_of(option.precision)},
                {"step_us", units::us_from(option.step)},
                {"loop_tick_us", units::us_from(option.tick)},
                {"tick_us", option.tick_us},
                {"error_us", option.measured() ? Json(option.error_us()) : Json()},
                {"spikes_without_partner", option.error.unmatched}};
  };
  Json tried = Json::array();
  for (const PlanOption& option : plan.tried) tried.push_back(option_json(option));
  const Json json = {{"spike_time_us", plan.budget_us ? Json(*plan.budget_us) : Json()},
                     {"chosen", option_json(plan.chosen)},
                     {"tried", std::move(tried)},
                     {"rehearsed_s", plan.rehearsed_s},
                     {"stand_in", plan.stand_in},
                     {"neurons", plan.neurons},
                     {"receptors", plan.receptors},
                     {"spikes", plan.spikes},
                     {"reached_share", plan.reached_share},
                     {"active_share", plan.active_share},
                     {"untouched_share", plan.untouched_share},
                     {"electrodes", plan.electrodes},
                     {"encoding_us", plan.encoding_us},
                     {"skipped", plan.skipped},
                     {"contact_law", plan.validity}};
  return json_text(json);
}

}  // namespace merkel
