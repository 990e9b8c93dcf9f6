// Goodwin, Macefield & Bisley 1997: spheres on human fingers.
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include <fmt/core.h>

#include "core/units.hpp"
#include "tools/studies/experiments/experiment.hpp"
#include "tools/studies/score/parallel_items.hpp"
#include "tools/studies/score/trials.hpp"

namespace merkel {

ExperimentOutcome spheres_on_human_fingers(const TactileModel::Parameters& scene,
                                           std::size_t threads) {
  const std::vector<double> curvatures_per_m = {0.0, 80.6, 172.0, 340.0, 694.0};
  const std::vector<double> forces_gwt = {40.0, 60.0, 80.0};
  constexpr double kN_per_gwt = 9.80665e-3;
  constexpr std::size_t kTrials = 10;
  const std::size_t conditions = curvatures_per_m.size() * forces_gwt.size();
  // The second half: a unit with half the gain.
  std::vector<double> rates(2 * conditions);
  const auto run = [&](std::size_t /*worker*/, std::size_t i) -> std::optional<ParameterError> {
    const std::size_t condition = i % conditions;
    TactileModel::Parameters unit = scene;
    if (i >= conditions) unit.adaptation.gain_Hz_per_kPa *= 0.5;
    const double curvature = curvatures_per_m[condition % curvatures_per_m.size()];
    Stimulus stimulus;
    stimulus.indenter.tip =
        SphereTip{curvature > 0.0 ? 1e3 / curvature : std::numeric_limits<double>::infinity()};
    stimulus.indenter.control = Indenter::Control::kForce;
    stimulus.level = units::mN_from_N(kN_per_gwt * forces_gwt[condition / curvatures_per_m.size()]);
    auto trials = Trials::create(unit, stimulus, kTrials);
    if (!trials) return trials.error();
    rates[i] = answer_of(stimulus, trials->run(stimulus)).value;
    return std::nullopt;
  };
  if (const auto error = try_each_item(rates.size(), threads, run)) {
    return Unexpected<ParameterError>(*error);
  }

  ExperimentResult result;
  double pairs = 0.0;
  double ordered = 0.0;
  const auto compare = [&](double lower, double higher) {
    pairs += 1.0;
    ordered += higher > lower ? 1.0 : 0.0;
  };
  const std::size_t n = curvatures_per_m.size();
  for (std::size_t f = 0; f < forces_gwt.size(); ++f) {
    ExperimentCurve curve{.series = fmt::format("{:g} gwt", forces_gwt[f]),
                          .x_name = "curvature, 1/m",
                          .y_name = "rate, Hz",
                          .x = curvatures_per_m};
    for (std::size_t c = 0; c < n; ++c) {
      curve.model.push_back(rates[f * n + c]);
      if (c > 0) compare(rates[f * n + c - 1], rates[f * n + c]);
      if (f > 0) compare(rates[(f - 1) * n + c], rates[f * n + c]);
    }
    result.curves.push_back(std::move(curve));
  }
  double product = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < conditions; ++i) {
    product += rates[i] * rates[conditions + i];
    squares += rates[i] * rates[i];
  }
  double missed = 0.0;
  for (std::size_t i = 0; i < conditions; ++i) {
    const double error = rates[conditions + i] - product / squares * rates[i];
    missed += error * error;
  }
  result.figures.push_back(
      {"pairs in which the more curved sphere, or the larger force, evokes the higher rate",
       ordered / pairs, "all", 1.0, 1.0});
  if (scene.energy_driven()) {
    result.figures.push_back(
        {"deviation of a unit of half the sensitivity from a multiple of the rates, rms",
         std::sqrt(missed / squares) / (product / squares), "0", 0.0, 0.1});
  }
  return result;
}

}  // namespace merkel
