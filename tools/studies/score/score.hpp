#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// What the model answers to the stimuli of a data set, and how far that is from the recordings.
struct SetScore {
  const DataSet* set = nullptr;
  std::vector<double> predicted;
  std::vector<double> count_sd;  ///< between trials, impulses
  double rmse = 0.0;
  double r2 = 0.0;  ///< square of the correlation; NaN of fewer than three points
  double R2 = 0.0;  ///< 1 − SSE/SST: below r² where the gain or offset is wrong, negative where the
                    ///< recordings' mean would do better
  /// Points that the scene cannot press, for example a flat plate on flat skin: their prediction is
  /// NaN, and they do not count.
  std::size_t skipped = 0;
};

/// Scores the data sets, with so many trials a stimulus. \param progress  told the fraction done
[[nodiscard]] Expected<std::vector<SetScore>, ParameterError> score_sets(
    const TactileModel::Parameters& scene, const std::vector<DataSet>& sets, std::size_t trials,
    const std::function<void(double)>& progress);

/// How regularly an afferent fires at a steady rate, and its intervals.
struct Regularity {
  double wanted_hz = 0.0;
  double rate_hz = 0.0;
  double cv = 0.0;        ///< standard deviation of the intervals over their mean
  double count_sd = 0.0;  ///< of the impulses in a second
  std::vector<double> intervals_ms;
};
/// Of neurons that energy density drives, held at a rate by a constant drive.
[[nodiscard]] Regularity regularity_at(const TactileModel::Parameters& scene, double rate_hz);

/// The rate at constant drives, without adaptation: the f–I curve.
struct DriveRate {
  double drive_hz = 0.0;
  double rate_hz = 0.0;
};
[[nodiscard]] std::vector<DriveRate> rates_by_drive(const TactileModel::Parameters& scene);

/// The area within which a pin of 0.5 mm diameter, pressed to a depth for a second, evokes at
/// least an impulse more than none would: π·r². Where there is a background depth, a plate around
/// the pin is lowered to it a second before.
[[nodiscard]] Expected<double, ParameterError> field_area_mm2(const TactileModel::Parameters& scene,
                                                              const Recordings::FieldArea& area,
                                                              std::size_t trials);

/// The rate under a pin with six more around it over the rate under the pin alone, in the second
/// from the touch. NaN where the pin alone evokes nothing.
[[nodiscard]] Expected<double, ParameterError> surround_ratio(const TactileModel::Parameters& scene,
                                                              const Recordings::Surround& surround,
                                                              std::size_t trials);

/// Whether a data set is one of those that the presets were fitted to (`merkel fit`).
[[nodiscard]] bool fitted_to(const DataSet& set);

/// The published scores of other models of these recordings, RMSE; NaN where there is none.
struct PeerScores {
  double touchsim;
  double ouyang;
};
[[nodiscard]] PeerScores peers_of(const std::string& set_name);

/// √(mean square difference).
[[nodiscard]] double root_mean_square_error(const std::vector<double>& a,
                                            const std::vector<double>& b);

}  // namespace merkel
