#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// The model's responses to the stimuli of a data set, and their deviation from the recordings.
struct SetScore {
  const DataSet* set = nullptr;
  std::vector<double> predicted;
  std::vector<double> count_sd;  ///< between trials, impulses
  double rmse = 0.0;
  double r2 = 0.0;  ///< square of the correlation; NaN of fewer than three points
  double R2 = 0.0;  ///< 1 − SSE/SST: below r² if the gain or offset is wrong, negative if the mean
                    ///< of the recordings is a better prediction
  /// Points that the scene cannot press, such as a flat plate on flat skin. Their prediction is
  /// NaN, and they do not count.
  std::size_t skipped = 0;
};

/// Scores the data sets. \param progress  called with the completed fraction
[[nodiscard]] Expected<std::vector<SetScore>, ParameterError> score_sets(
    const TactileModel::Parameters& scene, const std::vector<DataSet>& sets, std::size_t trials,
    const std::function<void(double)>& progress, std::size_t threads = 1);

/// True if the presets were fitted to a data set (`merkel fit`).
[[nodiscard]] bool fitted_to(const DataSet& set);

/// Published scores (RMSE) of other models of these recordings; NaN if there is none.
struct PeerScores {
  double touchsim;
  double ouyang;
};
[[nodiscard]] PeerScores peers_of(const std::string& set_name);

/// √(mean squared difference).
[[nodiscard]] double root_mean_square_error(const std::vector<double>& a,
                                            const std::vector<double>& b);

}  // namespace merkel
