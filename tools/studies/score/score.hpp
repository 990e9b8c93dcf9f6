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

/// The regularity of an afferent at a steady rate, and its intervals.
struct Regularity {
  double wanted_hz = 0.0;
  double rate_hz = 0.0;
  double cv = 0.0;        ///< standard deviation of the intervals over their mean
  double count_sd = 0.0;  ///< of the impulses in a second
  std::vector<double> intervals_ms;
};
/// Regularity of neurons driven by energy density, at a rate held by a constant drive.
[[nodiscard]] Regularity regularity_at(const TactileModel::Parameters& scene, double rate_hz);

/// The rate at constant drives, without adaptation: the f–I curve.
struct DriveRate {
  double drive_hz = 0.0;
  double rate_hz = 0.0;
};
[[nodiscard]] std::vector<DriveRate> rates_by_drive(const TactileModel::Parameters& scene);

/// The area within which a pin of 0.5 mm diameter, pressed to a depth for a second, evokes at least
/// one impulse more than no pin: π·r². With a background depth, a plate around the pin is lowered
/// to it one second before.
[[nodiscard]] Expected<double, ParameterError> field_area_mm2(const TactileModel::Parameters& scene,
                                                              const Recordings::FieldArea& area,
                                                              std::size_t trials);

/// The rate under a pin surrounded by six more, divided by the rate under the pin alone, in the
/// first second after touch. NaN if the pin alone evokes no impulse.
[[nodiscard]] Expected<double, ParameterError> surround_ratio(const TactileModel::Parameters& scene,
                                                              const Recordings::Surround& surround,
                                                              std::size_t trials);

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
