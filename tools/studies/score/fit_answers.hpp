#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/parameters/parameter_error.hpp"
#include "core/scene/afferents.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// A stimulus as the neurons receive it: its energy densities.
struct FitTrace {
  const DataSet::Point* point = nullptr;
  bool decline = false;
  double weight = 0.0;  ///< of its squared error in the cost
  std::vector<double> energy_kPa = {};
  std::chrono::nanoseconds tick{0};
  std::chrono::nanoseconds step{0};
};

/// The traces of all points. \param sets  outlive the traces
[[nodiscard]] Expected<std::vector<FitTrace>, ParameterError> fit_traces(
    const TactileModel::Parameters& scene, const std::vector<DataSet>& sets, std::size_t threads);

/// The model's responses to traces, in Hz; a decline in percent. Of the parameters that can be
/// fitted, only the radius of the receptive field changes the energy densities: it renews them.
class FitAnswers {
 public:
  /// \param sets  outlive the object.  \param traces  of `scene`.  \param trials  repetitions of
  /// each \param threads  that share the traces; the responses are the same for any number
  FitAnswers(TactileModel::Parameters scene, const std::vector<DataSet>& sets,
             std::vector<FitTrace> traces, std::size_t trials, std::size_t threads)
      : scene_(std::move(scene)),
        sets_(sets),
        traces_(std::move(traces)),
        trials_(trials),
        threads_(threads) {}

  [[nodiscard]] Eigen::VectorXd of(const TactileModel::Parameters& parameters);
  [[nodiscard]] Eigen::VectorXd measured() const;
  [[nodiscard]] Eigen::VectorXd weights() const;

 private:
  [[nodiscard]] double answer(const TactileModel::Parameters& parameters,
                              const FitTrace& trace) const;

  TactileModel::Parameters scene_;  ///< of the traces
  const std::vector<DataSet>& sets_;
  std::vector<FitTrace> traces_;
  std::size_t trials_;
  std::size_t threads_;
  std::map<std::chrono::nanoseconds, AfferentTables> tables_;  ///< by step
};

}  // namespace merkel
