#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "core/expected.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/experiments/experiment.hpp"
#include "tools/studies/report/report.hpp"

namespace merkel {

/// The tables that report_experiments() fills.
inline const TableHeads kExperimentTables = {
    {"experiments.csv", "experiment,figure,recorded,model,least,most,matches"},
    {"experiment_curves.csv", "experiment,title,series,x_name,y_name,x,model,recorded"}};

/// Runs experiments. Fills the tables with their figures and curves; returns the text.
[[nodiscard]] Expected<std::string, SetupError> report_experiments(
    std::span<const Experiment> experiments, const TactileModel::Parameters& scene,
    std::size_t threads, const ReportFolder& folder, ReportTables& tables);

}  // namespace merkel
