#include "tools/studies/plan/plan_report.hpp"

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
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

Json option_json(const PlanOption& option) {
  return {{"name", name_of_option(option)},
          {"method", name_of(option.method)},
          {"precision", name_of(option.precision)},
          {"step_us", units::us_from(option.step)},
          {"loop_tick_us", units::us_from(option.tick)},
          {"loop_tick_ms", units::ms_from(option.tick)},
          {"tick_us", option.tick_us},
          {"real_time_factor", units::us_from(option.tick) / option.tick_us},
          {"error_us", option.measured() ? Json(option.error_us()) : Json()},
          {"spikes_without_partner", option.error.unmatched},
          {"unmatched_percent", 100.0 * option.error.share_unmatched()}};
}

}  // namespace

Json plan_json(const Plan& plan) {
  const PlanOption& chosen = plan.chosen;
  Json json = {
      {"spike_time_us", plan.budget_us ? Json(*plan.budget_us) : Json()},
      {"error_to_meet_us", plan.budget_us ? Json(PlanOption::kMargin * *plan.budget_us) : Json()},
      {"chosen", option_json(chosen)},
      {"tried", Json::array()},
      {"rehearsed_s", plan.rehearsed_s},
      {"scene_tick_ms", plan.scene_tick_ms},
      {"shorter_tick", chosen.measured() && units::ms_from(chosen.tick) < plan.scene_tick_ms},
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
      {"validity", plan.validity}};
  json["chosen"]["name"] = name_of_neurons(plan);
  for (const PlanOption& option : plan.tried) json["tried"].push_back(option_json(option));
  return json;
}

Json prediction_json(const Plan& plan) {
  return {{"method", name_of(plan.chosen.method)},
          {"precision", name_of(plan.chosen.precision)},
          {"step_us", units::us_from(plan.chosen.step)},
          {"spike_time_us", plan.budget_us.value_or(0.0)},
          {"predicted_error_us", plan.chosen.measured() ? Json(plan.chosen.error_us()) : Json()},
          {"predicted_tick_us", plan.chosen.tick_us}};
}

}  // namespace merkel
