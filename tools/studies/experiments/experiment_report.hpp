#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "core/expected.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/experiments/experiment.hpp"
#include "tools/studies/report/report.hpp"

namespace merkel {

/// Runs experiments. Writes their figures and curves as tables (experiments.csv,
/// experiment_curves.csv); returns the text.
[[nodiscard]] Expected<std::string, SetupError> report_experiments(
    std::span<const Experiment> experiments, const TactileModel::Parameters& scene,
    std::size_t threads, const ReportFolder& folder);

}  // namespace merkel
