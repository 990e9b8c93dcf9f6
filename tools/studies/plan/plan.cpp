#include "tools/studies/plan/plan.hpp"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include <fmt/core.h>

#include "core/parameters/parameter_error.hpp"
#include "core/scene/model_check.hpp"
#include "core/scene/patch_layout.hpp"
#include "core/scene/tactile_patch.hpp"
#include "core/units.hpp"
#include "tools/run/touch_summary.hpp"
#include "tools/studies/plan/encoding_cost.hpp"
#include "tools/studies/plan/known_methods.hpp"
#include "tools/studies/plan/plan_report.hpp"
#include "tools/studies/plan/rehearsal.hpp"
#include "tools/studies/report/report.hpp"

namespace merkel {
namespace {

/// RK4 step of the reference: its error is far below any requested one.
constexpr std::chrono::nanoseconds kReferenceStep{2'500};
/// RK4 step with an error below 2 ns: the remaining error is the tick's.
constexpr std::chrono::nanoseconds kFineStep{12'500};
constexpr std::chrono::nanoseconds kMinTick{60'000};
constexpr std::int64_t kReferenceTicks = 16;  ///< fewest reference ticks per tick of the scene

/// The longest divisor of an interval that is at most `most`.
std::chrono::nanoseconds part_of(std::chrono::nanoseconds whole, std::chrono::nanoseconds most) {
  std::int64_t parts =
      std::max<std::int64_t>(1, (whole + most - std::chrono::nanoseconds{1}) / most);
  while (whole.count() % parts != 0) ++parts;
  return whole / parts;
}

/// The scene's tick, half of it, and so on.
std::vector<std::chrono::nanoseconds> ticks_of(std::chrono::nanoseconds tick) {
  std::vector<std::chrono::nanoseconds> ticks{tick};
  while (ticks.back().count() % 2 == 0 && ticks.back() / 2 >= kMinTick) {
    ticks.push_back(ticks.back() / 2);
  }
  return ticks;
}

/// False if the contact of a sliding surface needs a longer tick.
bool permits_tick(TactileModel::Parameters model, std::chrono::nanoseconds tick) {
  model.tick = tick;
  const auto checked = check(model);
  return checked || checked.error().key != "loop.tick_us";
}

/// The shortest multiple of `shortest` that divides `whole` and that the model permits.
std::chrono::nanoseconds permitted_tick(const TactileModel::Parameters& model,
                                        std::chrono::nanoseconds whole,
                                        std::chrono::nanoseconds shortest) {
  for (auto tick = shortest; tick < whole; tick += shortest) {
    if (whole % tick == std::chrono::nanoseconds{0} && permits_tick(model, tick)) return tick;
  }
  return whole;
}

/// Sets the shares of reached afferents and of active neurons, over ticks with contact.
Expected<void, SetupError> note_shares(const Scene& scene, const Rehearsal& rehearsal, Plan& plan) {
  auto model = TactileModel::create(scene.model);
  if (!model) return bad_input(scene.sentence(model.error()));
  double reached = 0.0;
  double active = 0.0;
  std::chrono::nanoseconds time{0};
  for (const Rehearsal::Tick& tick : rehearsal.ticks) {
    static_cast<void>(step(*model, tick, time));
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
  model.tick = option.tick;
}

PlanOption option_of(const TactileModel::Parameters& model) {
  PlanOption option{.step = model.step, .tick = model.tick};
  if (const auto* const paper = std::get_if<HodgkinHuxleyAfferent>(&model.afferent)) {
    option.method = paper->method;
    option.precision = paper->precision;
  }
  return option;
}

/// Rehearses a scene with several options and compares each with the reference.
class Rehearser {
 public:
  Rehearser(const Scene& scene, const ProbeRecording& recording)
      : scene_(scene), recording_(recording) {}

  /// \param ticks  candidates
  Expected<void, SetupError> make_reference(const std::vector<std::chrono::nanoseconds>& ticks) {
    Scene exact = scene_;
    auto tick = scene_.model.tick;
    // Another step changes the noise, so noisy neurons keep theirs, with a tick for each step.
    if (scene_.model.energy_driven()) {
      exact.model.tick = tick = permitted_tick(scene_.model, tick, scene_.model.step);
    } else {
      const auto shortest =
          part_of(ticks.back(), std::min(ticks.back() / 4, ticks.front() / kReferenceTicks));
      tick = permitted_tick(scene_.model, ticks.back(), shortest);
      set_option(exact.model, {.method = IntegrationMethod::kRk4,
                               .precision = Precision::kDouble,
                               .step = part_of(tick, kReferenceStep),
                               .tick = tick});
    }
    exact.model.accuracy = {.cull_tolerance = 0.0, .freeze_resting = false};
    auto model = TactileModel::create(exact.model);
    if (!model) return bad_input(scene_.sentence(model.error()));
    reference_ = run_through(*model, recording_.at(tick));
    validity_ = validity_json(scene_, *model);
    neurons_ = model->neurons();
    receptors_ = model->receptors();
    return {};
  }

  /// \param runs  number of runs; the cost is their median
  Expected<PlanOption, SetupError> perform(PlanOption option, int runs) {
    Scene variant = scene_;
    set_option(variant.model, option);
    auto model = TactileModel::create(variant.model);
    if (!model) return bad_input(scene_.sentence(model.error()));
    const Rehearsal& rehearsal = at(option.tick);
    std::vector<SpikeEvent> spikes;
    std::vector<double> seconds;
    for (int run = 0; run < runs; ++run) {
      const auto begin = std::chrono::steady_clock::now();
      spikes = run_through(*model, rehearsal);
      seconds.push_back(
          std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    std::sort(seconds.begin(), seconds.end());
    option.tick_us =
        1e6 * seconds[seconds.size() / 2] / static_cast<double>(rehearsal.ticks.size());
    option.error = spike_train_error(spikes, reference_);
    return option;
  }

  [[nodiscard]] const Rehearsal& at(std::chrono::nanoseconds tick) {
    if (rehearsal_.tick != tick) rehearsal_ = recording_.at(tick);
    return rehearsal_;
  }
  [[nodiscard]] bool fired() const noexcept { return !reference_.empty(); }
  void describe(Plan& plan) const {
    plan.spikes = reference_.size();
    plan.neurons = neurons_;
    plan.receptors = receptors_;
    plan.validity = validity_;
  }

 private:
  const Scene& scene_;
  const ProbeRecording& recording_;
  Rehearsal rehearsal_;
  std::vector<SpikeEvent> reference_;
  Json validity_;
  std::size_t neurons_ = 0;
  std::size_t receptors_ = 0;
};

/// The cheapest option that meets the budget; `tried` receives all tested options.
Expected<PlanOption, SetupError> choose(Rehearser& rehearser, const Scene& scene,
                                        const std::vector<std::chrono::nanoseconds>& ticks,
                                        double budget_us, std::vector<PlanOption>& tried) {
  if (!rehearser.fired()) {
    // No error can be measured: the most accurate option.
    const auto safe = rehearser.perform({.method = IntegrationMethod::kRk4,
                                         .precision = Precision::kDouble,
                                         .step = part_of(ticks.back(), kFineStep),
                                         .tick = ticks.back()},
                                        3);
    if (safe) tried.push_back(*safe);
    return safe;
  }
  for (const auto tick : ticks) {
    // The error of the tick alone, a lower bound for every method.
    const auto finest = rehearser.perform({.method = IntegrationMethod::kRk4,
                                           .precision = Precision::kDouble,
                                           .step = part_of(tick, kFineStep),
                                           .tick = tick},
                                          1);
    if (!finest) return Unexpected<SetupError>(finest.error());
    if (!finest->meets(budget_us)) {
      tried.push_back(*finest);
      continue;
    }
    for (const PlanOption& option : options_by_cost(tick, budget_us)) {
      const auto performed = rehearser.perform(option, 1);
      if (!performed) continue;  // the scene's network does not permit this step
      tried.push_back(*performed);
      if (performed->meets(budget_us)) return rehearser.perform(option, 3);
    }
    tried.push_back(*finest);
    return rehearser.perform(*finest, 3);
  }
  const auto best =
      std::min_element(tried.begin(), tried.end(), [](const PlanOption& a, const PlanOption& b) {
        return std::pair(a.error.unmatched, a.error_us()) <
               std::pair(b.error.unmatched, b.error_us());
      });
  const std::string what =
      best == tried.end()
          ? "cannot be met by any method"
          : fmt::format("cannot be met: the best is {:.3g} µs{}, with {}", best->error_us(),
                        best->error.unmatched > 0 ? " and unmatched spikes" : "",
                        name_of_option(*best));
  return bad_input(scene.sentence({.key = "accuracy.spike_time_us", .reason = what}));
}

std::vector<std::string> skipped(const Scene& scene, const Plan& plan) {
  std::vector<std::string> sentences;
  const TactileModel::Parameters& model = scene.model;
  if (!(model.network.gain > 0.0)) {
    sentences.emplace_back("coupling: network.gain is 0");
  }
  if (model.accuracy.cull_tolerance > 0.0) {
    sentences.push_back(fmt::format(
        "receptors out of reach of the contact, for {:.0f} % of the afferents on average (current change below "
        "{:g} of a receptor's largest)",
        100.0 * (1.0 - plan.reached_share), model.accuracy.cull_tolerance));
  }
  if (!model.energy_driven() && model.accuracy.freeze_resting) {
    sentences.push_back(fmt::format("neurons at rest, in blocks of 16: {:.0f} % of the steps",
                                    100.0 * (1.0 - plan.active_share)));
  }
  sentences.push_back(
      fmt::format("transduction in {:.0f} % of ticks (no contact)", 100.0 * plan.untouched_share));
  if (scene.sinks.empty()) sentences.emplace_back("sinks: the scene has none");
  return sentences;
}

}  // namespace

Expected<Plan, SetupError> make_plan(Scene& scene) {
  if (scene.model.energy_driven() && scene.spike_time_us) {
    return bad_input(scene.sentence(
        {.key = "accuracy.spike_time_us",
         .reason =
             "applies only to Hodgkin-Huxley neurons, because the others have noise: remove it"}));
  }
  // Large scenes have a shorter rehearsal, because the reference is slow. A network amplifies
  // errors for as long as its neurons fire nearly together, so an error limit takes a longer one.
  double neurons = 0.0;
  for (const PatchParameters& patch : scene.model.patches) {
    const auto size = size_of(patch);
    if (!size) return bad_input(scene.sentence(size.error()));
    neurons += size->afferents;
  }
  const bool coupled =
      scene.spike_time_us && !scene.model.energy_driven() && scene.model.network.gain > 0.0;
  const std::chrono::milliseconds most{neurons > 500.0 ? 250 : coupled ? 4000 : 1000};
  const auto recording = ProbeRecording::read(scene, most);
  if (!recording) return Unexpected<SetupError>(recording.error());
  if (const auto checked = TactileModel::create(scene.model); !checked) {
    return bad_input(scene.sentence(checked.error()));
  }

  Plan plan;
  plan.budget_us = scene.spike_time_us;
  plan.scene_tick_ms = units::ms_from(scene.model.tick);
  auto ticks = plan.budget_us ? ticks_of(scene.model.tick)
                              : std::vector<std::chrono::nanoseconds>{scene.model.tick};
  std::erase_if(ticks, [&](auto tick) { return !permits_tick(scene.model, tick); });
  Rehearser rehearser(scene, *recording);
  if (auto made = rehearser.make_reference(ticks); !made) {
    return Unexpected<SetupError>(made.error());
  }
  const auto chosen = plan.budget_us ? choose(rehearser, scene, ticks, *plan.budget_us, plan.tried)
                                     : rehearser.perform(option_of(scene.model), 3);
  if (!chosen) return Unexpected<SetupError>(chosen.error());
  plan.chosen = *chosen;
  if (plan.tried.empty()) plan.tried.push_back(plan.chosen);

  const Rehearsal rehearsal = recording->at(plan.chosen.tick);
  set_option(scene.model, plan.chosen);
  plan.rehearsed_s = units::s_from(plan.chosen.tick) * static_cast<double>(rehearsal.ticks.size());
  plan.kind = scene.model.kind();
  plan.stand_in = recording->stand_in();
  plan.untouched_share =
      static_cast<double>(rehearsal.untouched) / static_cast<double>(rehearsal.ticks.size());
  rehearser.describe(plan);
  if (auto noted = note_shares(scene, rehearsal, plan); !noted) {
    return Unexpected<SetupError>(noted.error());
  }
  plan.electrodes = scene.encoding.electrodes.size();
  const auto encoding_us = encoding_cost_us(scene, rehearsal);
  if (!encoding_us) return Unexpected<SetupError>(encoding_us.error());
  plan.encoding_us = *encoding_us;
  plan.skipped = skipped(scene, plan);
  return plan;
}

}  // namespace merkel
