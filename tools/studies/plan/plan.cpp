#include "tools/studies/plan/plan.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <string>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "core/scene/patch_layout.hpp"
#include "core/units.hpp"
#include "tools/scene/contact_sentence.hpp"
#include "tools/studies/bench/measure.hpp"
#include "tools/studies/plan/plan_report.hpp"
#include "tools/studies/plan/rehearsal.hpp"
#include "tools/studies/report/report.hpp"

namespace merkel {
namespace {

/// Steps of RK4 so fine that its own error is far below any that is asked for.
constexpr double kReferenceStep_us = 2.5;

struct Performance {
  std::vector<SpikeEvent> spikes;
  double tick_us = 0.0;
};

Expected<Performance, SetupError> perform(const Scene& scene, const Rehearsal& rehearsal) {
  auto model = TactileModel::create(scene.model);
  if (!model) return bad_input(scene.sentence(model.error()));
  Performance performance;
  const Measurement cost =
      measure([&] { performance.spikes = run_through(*model, rehearsal); }, 3, 0.005);
  performance.tick_us = 1e6 * cost.median_s / static_cast<double>(rehearsal.ticks.size());
  return performance;
}

/// The shares of afferents that are reached and of neurons that are active, over touched ticks.
Expected<void, SetupError> note_shares(const Scene& scene, const Rehearsal& rehearsal, Plan& plan) {
  auto model = TactileModel::create(scene.model);
  if (!model) return bad_input(scene.sentence(model.error()));
  double reached = 0.0;
  double active = 0.0;
  std::chrono::nanoseconds time{0};
  for (const auto& contacts : rehearsal.ticks) {
    model->step(contacts, time);
    time += scene.model.tick;
    for (const TactilePatch& patch : model->patches()) {
      reached += static_cast<double>(patch.drive().afferents_reached());
      active += static_cast<double>(patch.active_neurons());
    }
  }
  const auto neurons = static_cast<double>(model->neurons());
  const double ticks = static_cast<double>(rehearsal.ticks.size());
  const double touched = ticks - static_cast<double>(rehearsal.untouched);
  plan.reached_share = touched > 0.0 ? reached / (touched * neurons) : 0.0;
  plan.active_share = active / (ticks * neurons);
  return {};
}

void set_option(TactileModel::Parameters& model, const PlanOption& option) {
  if (auto* const paper = std::get_if<HodgkinHuxleyAfferent>(&model.afferent)) {
    paper->method = option.method;
    paper->precision = option.precision;
  }
  model.step = option.step;
}

PlanOption option_of(const TactileModel::Parameters& model) {
  PlanOption option{.step = model.step};
  if (const auto* const paper = std::get_if<HodgkinHuxleyAfferent>(&model.afferent)) {
    option.method = paper->method;
    option.precision = paper->precision;
  }
  return option;
}

/// What is known of a method at a step before the scene is looked at.
struct KnownMethod {
  IntegrationMethod method;
  Precision precision;
  double step_us;
  double cost_us;
  double error_us;
};
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr KnownMethod kKnown[] = {
#include "tools/studies/plan/method_table.inc"
};

/// How far a scene's errors may lie from the table's, which are of neurons that fire at 70 Hz for
/// half a second: near threshold they are larger.
constexpr double kTableDoubt = 20.0;

/// What may meet the budget and divides the tick, from the cheapest.
std::vector<PlanOption> options_by_cost(const TactileModel::Parameters& model, double budget_us) {
  std::vector<KnownMethod> known(std::begin(kKnown), std::end(kKnown));
  std::stable_sort(known.begin(), known.end(), [](const KnownMethod& a, const KnownMethod& b) {
    return a.cost_us < b.cost_us;
  });
  std::vector<PlanOption> options;
  for (const KnownMethod& candidate : known) {
    const auto step = units::nanoseconds_from_us(candidate.step_us);
    if (candidate.error_us > kTableDoubt * budget_us) continue;
    if (model.tick % step != std::chrono::nanoseconds{0}) continue;
    if (units::ms_from(step) > largest_step_ms(candidate.method, 0.0)) continue;
    options.push_back({.method = candidate.method, .precision = candidate.precision, .step = step});
  }
  return options;
}

std::vector<std::string> left_out(const Scene& scene, const Plan& plan) {
  std::vector<std::string> sentences;
  const TactileModel::Parameters& model = scene.model;
  if (!(model.network.gain > 0.0)) {
    sentences.emplace_back("coupling: network.gain is 0");
  }
  if (model.accuracy.cull_tolerance > 0.0) {
    sentences.push_back(
        format("receptors beyond reach: %.0f %% of the afferents on average, whose currents the "
               "press moves by less than %g of a receptor's largest each",
               100.0 * (1.0 - plan.reached_share), model.accuracy.cull_tolerance));
  }
  if (!model.energy_driven() && model.accuracy.freeze_resting) {
    sentences.push_back(format("neurons at rest, in blocks of 16: %.0f %% of all steps",
                               100.0 * (1.0 - plan.active_share)));
  }
  sentences.push_back(format("transduction where nothing touches: %.0f %% of the ticks",
                             100.0 * plan.untouched_share));
  if (scene.sinks.empty()) sentences.emplace_back("sinks: none is asked for");
  return sentences;
}

}  // namespace

Expected<Plan, SetupError> make_plan(Scene& scene) {
  // Large scenes are rehearsed for less time: the reference is what takes long.
  std::size_t neurons = 0;
  for (const PatchParameters& patch : scene.model.patches) {
    const auto layout = layout_of(patch);
    if (!layout) return bad_input(scene.sentence(layout.error()));
    neurons += layout->afferents.size();
  }
  const std::chrono::milliseconds most{neurons > 500 ? 250 : 1000};
  const auto rehearsal = rehearse(scene, most);
  if (!rehearsal) return Unexpected<SetupError>(rehearsal.error());

  Scene exact = scene;
  const bool judged = !scene.model.energy_driven();
  if (judged) {
    set_option(exact.model, {.method = IntegrationMethod::kRk4,
                             .precision = Precision::kDouble,
                             .step = units::nanoseconds_from_us(kReferenceStep_us)});
  } else if (scene.spike_time_us) {
    return bad_input(scene.sentence(
        {.key = "accuracy.spike_time_us",
         .reason = "is for Hodgkin-Huxley neurons: noise moves the spikes of others anyway"}));
  }
  exact.model.accuracy = {.cull_tolerance = 0.0, .freeze_resting = false};
  auto exact_model = TactileModel::create(exact.model);
  if (!exact_model) return bad_input(scene.sentence(exact_model.error()));
  const std::vector<SpikeEvent> reference = run_through(*exact_model, *rehearsal);

  Plan plan;
  plan.budget_us = scene.spike_time_us;
  const auto try_option = [&](const PlanOption& option) -> Expected<PlanOption, SetupError> {
    Scene variant = scene;
    set_option(variant.model, option);
    const auto performance = perform(variant, *rehearsal);
    if (!performance) return Unexpected<SetupError>(performance.error());
    PlanOption tried = option;
    tried.tick_us = performance->tick_us;
    tried.error = spike_train_error(performance->spikes, reference);
    plan.tried.push_back(tried);
    return tried;
  };
  if (!plan.budget_us) {
    const auto own = try_option(option_of(scene.model));
    if (!own) return Unexpected<SetupError>(own.error());
    plan.chosen = *own;
  } else {
    std::optional<PlanOption> found;
    for (const PlanOption& option : options_by_cost(scene.model, *plan.budget_us)) {
      const auto tried = try_option(option);
      if (!tried) continue;  // the scene's network does not allow the step
      if (tried->meets(*plan.budget_us)) {
        found = *tried;
        break;
      }
    }
    if (!found) {
      // The most exact there is, to say what could be had.
      static_cast<void>(try_option({.method = IntegrationMethod::kRk4,
                                    .precision = Precision::kDouble,
                                    .step = units::nanoseconds_from_us(6.25)}));
      const auto best = std::min_element(plan.tried.begin(), plan.tried.end(),
                                         [](const PlanOption& a, const PlanOption& b) {
                                           return std::pair(a.error.unmatched, a.error_us()) <
                                                  std::pair(b.error.unmatched, b.error_us());
                                         });
      const std::string what =
          best == plan.tried.end()
              ? "cannot be met by any method"
              : format("cannot be met: the best is %.3g µs%s, with %s", best->error_us(),
                       best->error.unmatched > 0 ? " and some spikes too many or too few" : "",
                       name_of_option(*best).c_str());
      return bad_input(scene.sentence({.key = "accuracy.spike_time_us", .reason = what}));
    }
    plan.chosen = *found;
    set_option(scene.model, plan.chosen);
  }
  plan.rehearsed_s = units::s_from(scene.model.tick) * static_cast<double>(rehearsal->ticks.size());
  plan.tick_ms = units::ms_from(scene.model.tick);
  plan.kind = scene.model.kind();
  plan.stand_in = rehearsal->stand_in;
  plan.spikes = reference.size();
  plan.neurons = exact_model->neurons();
  plan.receptors = exact_model->receptors();
  plan.untouched_share =
      static_cast<double>(rehearsal->untouched) / static_cast<double>(rehearsal->ticks.size());
  if (auto noted = note_shares(scene, *rehearsal, plan); !noted) {
    return Unexpected<SetupError>(noted.error());
  }
  plan.left_out = left_out(scene, plan);
  for (std::size_t i = 0; i < exact_model->indenters(); ++i) {
    plan.validity.push_back(contact_sentence(exact_model->deepest()[i], *exact_model, i));
  }
  return plan;
}

}  // namespace merkel
