#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "tools/json_text.hpp"
#include "tools/scene/scene_file.hpp"
#include "tools/studies/report/spike_train_error.hpp"

namespace merkel {

/// A way to step the neurons of a scene, with its cost and error in a rehearsal.
struct PlanOption {
  IntegrationMethod method = IntegrationMethod::kCrankNicolson;
  Precision precision = Precision::kDouble;
  std::chrono::nanoseconds step{0};
  std::chrono::nanoseconds tick{0};
  double tick_us = 0.0;   ///< mean cost of a tick
  SpikeTrainError error;  ///< against RK4 at a fine step and tick, with nothing skipped
  [[nodiscard]] double error_us() const noexcept { return 1e3 * error.rms_ms; }
  /// False if nothing fired in the rehearsal.
  [[nodiscard]] bool measured() const noexcept { return error.matched + error.unmatched > 0; }
  /// True if there are spikes, every one has a partner and the error is within the budget, with a
  /// margin for the error of the reference and for the time after the rehearsal.
  static constexpr double kMargin = 0.8;
  [[nodiscard]] bool meets(double budget_us) const noexcept {
    return error.matched > 0 && error.unmatched == 0 && error_us() <= kMargin * budget_us;
  }
};

/// The predicted cost and accuracy of a scene.
struct Plan {
  PlanOption chosen;
  NeuronKind kind = NeuronKind::kHodgkinHuxley;  ///< other kinds have a single method
  std::vector<PlanOption>
      tried;  ///< from the longest tick, by expected cost; the chosen one is last
  std::optional<double> budget_us;  ///< [accuracy] spike_time_us
  double rehearsed_s = 0.0;
  double scene_tick_ms = 0.0;  ///< the scene's tick; the plan may choose a shorter one
  bool stand_in = false;       ///< the probe is a device, replaced by a ramp-and-hold
  std::size_t spikes = 0;
  std::size_t neurons = 0;
  std::size_t receptors = 0;
  double untouched_share = 0.0;      ///< of ticks, without transduction
  double reached_share = 0.0;        ///< of afferents during contact; the others are skipped
  double active_share = 0.0;         ///< of neurons; the others are at rest
  std::vector<std::string> skipped;  ///< sentences: what is skipped, and why
  Json validity;                     ///< of the presses: validity_json()
  std::size_t electrodes = 0;
  double encoding_us = 0.0;  ///< per tick, for the stimulation commands
};

/// Rehearses the first press of the scene (at most one second). Without [accuracy] spike_time_us,
/// uses the scene's tick and method. With it, first halves the tick until the error of
/// interpolating currents within a tick no longer matters, then tries the methods in order of cost
/// until one meets the budget. Errors are relative to RK4 at 2.5 µs and a tick of at most 1/16 of
/// the scene's and 1/4 of the shortest candidate. Sets the scene's tick, method, precision and
/// step. If no method meets the budget, fails and names the best one. If nothing
/// fires in the rehearsal, no error is known: takes the most accurate method and the shortest tick.
/// Takes seconds. Real-time: no.
[[nodiscard]] Expected<Plan, SetupError> make_plan(Scene& scene);

}  // namespace merkel
