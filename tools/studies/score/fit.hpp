#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// A parameter of a scene that can be fitted.
struct FitParameter {
  std::string name;   ///< for example "fast_weight"
  std::string table;  ///< of a scene file: "afferent" or "neuron"
  /// Its value in a model. The model's neurons must have it.
  [[nodiscard]] double* in(TactileModel::Parameters& model) const;
};
/// All there are; those that a neuron does not have are left out.
[[nodiscard]] std::vector<FitParameter> fit_parameters(NeuronKind kind);

/// How well the data fix a fitted parameter.
struct FittedParameter {
  std::string name;
  std::string table;
  double before = 0.0;
  double after = 0.0;
  double relative_error = 0.0;  ///< standard error of ln p, from the curvature of the cost
};

struct FitResult {
  double cost_before = 0.0;  ///< Hz²
  double cost_after = 0.0;
  std::vector<FittedParameter> parameters;
  std::vector<std::vector<double>> correlation;  ///< of the errors of two parameters
  /// Largest over smallest curvature of the cost in the logarithms of the parameters: beyond 1e4, a
  /// combination of them is not fixed by the data.
  double condition = 0.0;
  int evaluations = 0;
  std::size_t measurements = 0;

  /// Beyond this relative standard error, the data do not determine a parameter.
  static constexpr double kLargestError = 0.3;
  static constexpr double kLargestCondition = 1e4;
  /// Whether there are more measurements than parameters, each parameter's error is below
  /// kLargestError, and no combination of them is left open.
  [[nodiscard]] bool determined() const;
};

/// Fits parameters of a scene whose neurons energy density drives, by the subplex method of Rowan
/// (NLopt, LN_SBPLX) in their logarithms, each within a factor of 20 of its start.
///
/// The cost is the mean over all data sets of the mean square error, in Hz²; a decline that is
/// wrong by 1 % counts as 1 Hz. All evaluations have the same noise. The stimuli's energy densities
/// are computed once: what is fitted does not change them. Sets with fit = false are left out.
/// Fails where a name is not known or the scene's neurons are driven otherwise.
[[nodiscard]] Expected<FitResult, SetupError> fit(TactileModel::Parameters& scene,
                                                  const std::vector<DataSet>& sets,
                                                  const std::vector<std::string>& names,
                                                  std::size_t trials, int most_evaluations,
                                                  const std::function<void(double)>& progress);

}  // namespace merkel
