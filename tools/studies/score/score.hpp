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

/// For each depth, the area within which a pin of an array, pressed deeper for a second, evokes at
/// least one impulse more than the array: an ellipse, from its radii along and across the finger.
/// An array of one pin is a pin on bare skin.
struct FieldArea {
  double area_mm2 = 0.0;
  double response = 0.0;  ///< impulses in the middle of the field, above those of the array
};
[[nodiscard]] Expected<std::vector<FieldArea>, ParameterError> field_areas(
    const TactileModel::Parameters& scene, const Recordings::FieldAreas& areas, std::size_t trials,
    std::size_t threads);

/// For each number of pins of an array that are pressed deeper, the impulses above those of the
/// array, divided by the same with the middle pin alone. NaN if that evokes none.
[[nodiscard]] Expected<std::vector<double>, ParameterError> surround_ratios(
    const TactileModel::Parameters& scene, const Recordings::Surround& surround, std::size_t trials,
    std::size_t threads);

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
