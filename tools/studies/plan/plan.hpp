#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "tools/scene/scene_file.hpp"
#include "tools/studies/report/spike_train_error.hpp"

namespace merkel {

/// A way to step the neurons of a scene, and what a rehearsal of the scene showed of it.
struct PlanOption {
  IntegrationMethod method = IntegrationMethod::kCrankNicolson;
  Precision precision = Precision::kDouble;
  std::chrono::nanoseconds step{0};
  std::chrono::nanoseconds tick{0};
  double tick_us = 0.0;   ///< mean cost of a tick
  SpikeTrainError error;  ///< against RK4 at a fine step and tick, with nothing left out
  [[nodiscard]] double error_us() const noexcept { return 1e3 * error.rms_ms; }
  /// Whether every spike has its partner and they are as near as asked for, with a margin for what
  /// the reference itself is off and for what follows the rehearsed second.
  static constexpr double kMargin = 0.8;
  [[nodiscard]] bool meets(double budget_us) const noexcept {
    return error.unmatched == 0 && error_us() <= kMargin * budget_us;
  }
};

/// What a scene will cost and how exact it will be.
struct Plan {
  PlanOption chosen;
  NeuronKind kind = NeuronKind::kHodgkinHuxley;  ///< others are stepped in one way only
  std::vector<PlanOption> tried;    ///< from the longest tick, by expected cost; the chosen last
  std::optional<double> budget_us;  ///< [accuracy] spike_time_us
  double rehearsed_s = 0.0;
  double scene_tick_ms = 0.0;  ///< what the scene asks for; the plan may choose a shorter one
  bool stand_in = false;       ///< the probe is a device: a 1.5 mm ramp-and-hold stood in for it
  std::size_t spikes = 0;
  std::size_t neurons = 0;
  std::size_t receptors = 0;
  double untouched_share = 0.0;       ///< of ticks: no transduction
  double reached_share = 0.0;         ///< of afferents, while touched: others are beyond reach
  double active_share = 0.0;          ///< of neurons: others are at rest
  std::vector<std::string> left_out;  ///< sentences: what is left out, and why
  std::vector<std::string> validity;  ///< of each probe's contact law at its deepest press
  std::size_t electrodes = 0;
  double encoding_us = 0.0;  ///< a tick, of the stimulation commands
};

/// Rehearses the scene's first press (at most a second). Without [accuracy] spike_time_us, with the
/// scene's own tick and method. With it, first halves the tick until the course of the currents
/// within it no longer matters, then tries one method after the other, from the cheapest, until one
/// meets the budget. Errors are those against RK4 at 2.5 µs and a tick that is at most 1/16 of the
/// scene's and 1/4 of the shortest that may be chosen. Sets the scene's tick, method, precision and
/// step to the chosen. Fails where nothing meets the budget: the best is named. Takes seconds.
/// Real-time: no.
[[nodiscard]] Expected<Plan, SetupError> make_plan(Scene& scene);

}  // namespace merkel
