#include "tools/studies/experiments/experiment_report.hpp"

#include <cmath>
#include <limits>

#include <fmt/core.h>

#include "tools/studies/report/csv_table.hpp"

namespace merkel {
namespace {

std::string accepted(const ExperimentFigure& figure) {
  if (std::isinf(figure.most)) return fmt::format("above {:g}", figure.least);
  return figure.least == figure.most ? fmt::format("{:g}", figure.least)
                                     : fmt::format("{:g} to {:g}", figure.least, figure.most);
}

}  // namespace

Expected<std::string, SetupError> report_experiments(std::span<const Experiment> experiments,
                                                     const TactileModel::Parameters& scene,
                                                     std::size_t threads,
                                                     const ReportFolder& folder,
                                                     ReportTables& tables) {
  CsvTable& figures = tables.at("experiments.csv");
  CsvTable& curves = tables.at("experiment_curves.csv");
  std::string text;
  std::size_t done = 0;
  for (const Experiment& experiment : experiments) {
    text += fmt::format("### {}, not fitted\n\n{}. Protocol: {}.\n\n", experiment.title,
                        experiment.cite, experiment.protocol);
    const auto result = experiment.run(scene, threads);
    folder.report(static_cast<double>(++done) / static_cast<double>(experiments.size()));
    if (!result) {
      text += fmt::format("Not possible with this scene: {} {}.\n\n", result.error().key,
                          result.error().reason);
      continue;
    }
    text += "| figure | model | recorded | match | |\n|---|---|---|---|---|\n";
    for (const ExperimentFigure& figure : result->figures) {
      const std::string model =
          std::isfinite(figure.model) ? fmt::format("{:.2f}", figure.model) : "–";
      text += fmt::format("| {} | {} | {} | {} | {} |\n", figure.name, model, figure.recorded,
                          accepted(figure), figure.matches() ? "yes" : "**no**");
      figures.row({experiment.name, figure.name, figure.recorded},
                  {figure.model, figure.least, figure.most, figure.matches() ? 1.0 : 0.0});
    }
    text += "\n";
    for (const ExperimentCurve& curve : result->curves) {
      for (std::size_t i = 0; i < curve.x.size(); ++i) {
        curves.row({experiment.name, experiment.title, curve.series, curve.x_name, curve.y_name},
                   {curve.x[i], curve.model[i],
                    curve.recorded.empty() ? std::numeric_limits<double>::quiet_NaN()
                                           : curve.recorded[i]});
      }
    }
  }
  return text;
}

}  // namespace merkel
