#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/commands/command.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/studies/experiments/experiment_report.hpp"
#include "tools/studies/report/report.hpp"
#include "tools/studies/score/recordings.hpp"
#include "tools/studies/score/scorecard.hpp"

namespace merkel {
namespace {

struct ScoreCommand {
  std::string scene = "goodwin";
  std::string data;
  std::string folder = "score";
  double trials = 50;
  std::optional<double> threads;
  bool skip_experiments = false;
  bool overwrite = false;
};

int score(const ScoreCommand& command) {
  const auto scene = scene_named(command.scene);
  if (!scene) return refuse(scene.error());
  const auto recordings = recordings_named(command.data, scene->probes.front().input.contact);
  if (!recordings) return refuse(recordings.error());
  const std::size_t threads = jobs_or_cores(command.threads);
  std::vector<ReportPart> parts = {{"scorecard", scorecard_tables(*scene, *recordings),
                                    [&](const ReportFolder& folder, ReportTables& tables) {
                                      return scorecard(*scene, *recordings, command.data,
                                                       static_cast<std::size_t>(command.trials),
                                                       threads, folder, tables);
                                    }}};
  if (command.data.empty() && !command.skip_experiments) {
    parts.push_back(
        {"experiments", kExperimentTables, [&](const ReportFolder& folder, ReportTables& tables) {
           const auto text =
               report_experiments(experiments(), scene->model, threads, folder, tables);
           return text ? "\n## Whole experiments, not fitted\n\n" + *text : text;
         }});
  }
  return make_report({.folder = command.folder, .file = "score.md", .overwrite = command.overwrite},
                     "# Score of " + command.scene + " against " +
                         (command.data.empty() ? "published recordings" : command.data) + "\n\n",
                     parts, "score");
}

}  // namespace

void add_score_command(CommandLine& program) {
  auto command = std::make_shared<ScoreCommand>();
  program
      .subcommand(
          "score",
          "Repeats recorded presses on the model's afferents, and reports how far the rates are "
          "from the recorded ones: RMSE, r² and R² for each data set next to the published "
          "scores of other models, tables (CSV) and pictures (PNG).",
          "score goodwin --out score")
      .option("scene", command->scene, "Scene file (TOML), or a preset; default goodwin")
      .option("--data", command->data,
              "Recordings (JSON; format in tools/README.md) instead of the published ones")
      .option("--out", command->folder, "Folder to write to")
      .option("--trials", command->trials, "Repetitions of each press", {1, 10000})
      .option("--jobs", command->threads, kThreadsHelp, {1, 1024})
      .flag("--skip-experiments", command->skip_experiments,
            "Leave out the experiments that the sources describe by statements, such as scanned "
            "squares and gratings: most of the time of a score")
      .flag("--overwrite", command->overwrite, "Replace existing files")
      .runs([command] { return score(*command); });
}

}  // namespace merkel
