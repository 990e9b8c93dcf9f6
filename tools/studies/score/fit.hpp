#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// A parameter of a scene that can be fitted.
struct FitParameter {
  std::string table;  ///< table of a scene file: "afferent", "receptors" or "neuron"
  std::string key;    ///< for example "fast_weight"
  std::string name;   ///< the key; with its table if an earlier parameter has the same key
  /// Its value in a model. The model's neurons must have it.
  [[nodiscard]] double* in(TactileModel::Parameters& model) const;
};
/// All parameters of a kind of neuron.
[[nodiscard]] std::vector<FitParameter> fit_parameters(NeuronKind kind);

/// A fitted parameter and its standard error.
struct FittedParameter {
  FitParameter parameter;
  double before = 0.0;
  double after = 0.0;
  double relative_error = 0.0;  ///< standard error of ln p, from the curvature of the cost
};

struct FitResult {
  double cost_before = 0.0;  ///< Hz²
  double cost_after = 0.0;
  std::vector<FittedParameter> parameters;
  std::vector<std::vector<double>> correlation;  ///< between the errors of two parameters
  /// Largest over smallest curvature of the cost in the logarithms of the parameters. Above 1e4,
  /// the data do not determine some combination of them.
  double condition = 0.0;
  int evaluations = 0;
  std::size_t measurements = 0;

  /// Above this relative standard error, the data do not determine a parameter.
  static constexpr double kLargestError = 0.3;
  static constexpr double kLargestCondition = 1e4;
  /// True if there are more measurements than parameters, each parameter's error is below
  /// kLargestError, and all combinations are determined.
  [[nodiscard]] bool determined() const;
};

/// Sets the fitted parameters, in the six digits that reports show.
void set_fitted(TactileModel::Parameters& model, const FitResult& result);

/// Takes the share of the evaluations that are made. False: the fit ends.
using FitProgress = std::function<bool(double share)>;
/// The model's responses to all points of a fit, computed elsewhere from the values of the fitted
/// parameters; empty: the fit ends.
using FitResponses = std::function<std::vector<double>(const std::vector<double>& values)>;

/// Every `parts`-th point of a fit, from `part` on: their responses, for a worker of FitResponses.
[[nodiscard]] Expected<FitResponses, SetupError> fit_part(const TactileModel::Parameters& scene,
                                                          const std::vector<DataSet>& sets,
                                                          const std::vector<std::string>& names,
                                                          std::size_t trials, std::size_t part,
                                                          std::size_t parts);
/// Number of points of a fit.
[[nodiscard]] std::size_t fit_points(const std::vector<DataSet>& sets);

/// Fits parameters of a scene with neurons driven by energy density, by Rowan's subplex method
/// (NLopt, LN_SBPLX) in the logarithms of the parameters, each within a factor of 20 of its start.
///
/// The cost is the mean over all data sets of the mean square error, in Hz²; a decline that is
/// wrong by 1 % counts as 1 Hz. All evaluations have the same noise. The stimuli's energy densities
/// are computed once, and again for each radius of the receptive field. Sets with fit = false are
/// ignored. The result is the same for any number of threads, and with `elsewhere`. Fails where a
/// name is unknown or the scene's neurons are driven otherwise.
[[nodiscard]] Expected<FitResult, SetupError> fit(
    TactileModel::Parameters& scene, const std::vector<DataSet>& sets,
    const std::vector<std::string>& names, std::size_t trials, int most_evaluations,
    const FitProgress& progress, std::size_t threads = 1, const FitResponses& elsewhere = {});

}  // namespace merkel
