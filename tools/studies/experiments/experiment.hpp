#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"

namespace merkel {

/// A figure that a source states, and the model's. What counts as a match was fixed before the
/// model was run.
struct ExperimentFigure {
  std::string name;
  double model = 0.0;
  std::string recorded = {};  ///< as the source states it
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool matches() const noexcept { return model >= least && model <= most; }
};

/// A line of the experiment's picture. NaN in `recorded` where the source states nothing.
struct ExperimentCurve {
  std::string series;
  std::string x_name;
  std::string y_name;
  std::vector<double> x = {};
  std::vector<double> model = {};
  std::vector<double> recorded = {};  ///< empty: no figure for any x
};

struct ExperimentResult {
  std::vector<ExperimentFigure> figures;
  std::vector<ExperimentCurve> curves;
};

using ExperimentOutcome = Expected<ExperimentResult, ParameterError>;
using RunExperiment = ExperimentOutcome(const TactileModel::Parameters& scene, std::size_t threads);

/// A published experiment, repeated on the model's afferent. No parameter is fitted to it.
struct Experiment {
  const char* name;  ///< of its picture
  const char* title;
  const char* cite;
  const char* protocol;  ///< with what the open text of the source does not state
  RunExperiment* run;
};

/// All experiments. To add one: its function here and its row in experiments.cpp.
[[nodiscard]] std::span<const Experiment> experiments();

RunExperiment scanned_squares, vibrating_gratings, gaps_in_a_plate, spheres_on_human_fingers,
    turned_cylinders;

}  // namespace merkel
