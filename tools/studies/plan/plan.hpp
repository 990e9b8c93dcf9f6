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
  double tick_us = 0.0;   ///< mean cost of a tick
  SpikeTrainError error;  ///< against RK4 at a fine step, with nothing left out
  [[nodiscard]] double error_us() const noexcept { return 1e3 * error.rms_ms; }
  /// Whether every spike has its partner and they are as near as asked for.
  [[nodiscard]] bool meets(double budget_us) const noexcept {
    return error.unmatched == 0 && error_us() <= budget_us;
  }
};

/// What a scene will cost and how exact it will be.
struct Plan {
  PlanOption chosen;
  NeuronKind kind = NeuronKind::kHodgkinHuxley;  ///< others are stepped in one way only
  std::vector<PlanOption> tried;    ///< in the order of the expected cost, the chosen last
  std::optional<double> budget_us;  ///< [accuracy] spike_time_us
  double rehearsed_s = 0.0;
  double tick_ms = 0.0;
  bool stand_in = false;  ///< the probe is a device: a 1.5 mm ramp-and-hold stood in for it
  std::size_t spikes = 0;
  std::size_t neurons = 0;
  std::size_t receptors = 0;
  double untouched_share = 0.0;       ///< of ticks: no transduction
  double reached_share = 0.0;         ///< of afferents, while touched: others are beyond reach
  double active_share = 0.0;          ///< of neurons: others are at rest
  std::vector<std::string> left_out;  ///< sentences: what is left out, and why
  std::vector<std::string> validity;  ///< of each probe's contact law at its deepest press
};

/// Rehearses the scene's first press (at most a second) with one method after the other, from the
/// cheapest, until one meets [accuracy] spike_time_us; without it, with the scene's own method.
/// Sets the scene's method, precision and step to the chosen. Fails where no method meets the
/// budget: the best is named. Takes seconds. Real-time: no.
[[nodiscard]] Expected<Plan, SetupError> make_plan(Scene& scene);

}  // namespace merkel
