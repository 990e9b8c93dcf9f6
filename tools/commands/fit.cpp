#include "tools/studies/score/fit.hpp"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "drivers/files/output_file.hpp"
#include "drivers/printable_text.hpp"
#include "tools/commands/command.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/studies/report/report.hpp"
#include "tools/studies/score/recorded_trials.hpp"

namespace merkel {
namespace {

struct FitCommand {
  std::string scene = "goodwin";
  std::string data;
  std::string out = "fitted.toml";
  std::string report;
  std::vector<std::string> parameters;
  double trials = 16;
  double evaluations = 200;
  std::optional<double> threads;
  bool overwrite = false;
};

std::string report_of(const FitResult& result) {
  std::string text = fmt::format("cost {:.3f} Hz² before, {:.3f} Hz² after; {} evaluations\n\n",
                                 result.cost_before, result.cost_after, result.evaluations);
  text += "| parameter | before | after | standard error |";
  for (const FittedParameter& fitted : result.parameters) {
    text += " corr. with " + fitted.parameter.name + " |";
  }
  text += "\n|---|---|---|---|";
  for (std::size_t k = 0; k < result.parameters.size(); ++k) text += "---|";
  text += "\n";
  for (std::size_t k = 0; k < result.parameters.size(); ++k) {
    const FittedParameter& fitted = result.parameters[k];
    text += fmt::format("| {} | {:.6g} | {:.6g} | ", fitted.parameter.name, fitted.before,
                        fitted.after);
    // The standard error is that of ln p: a small fraction of p, or meaningless.
    text += fitted.relative_error < 1.0 ? fmt::format("{:.1f} % |", 100.0 * fitted.relative_error)
                                        : "none: over 100 % |";
    for (const double correlation : result.correlation[k]) {
      text += std::isfinite(correlation) ? fmt::format(" {:.2f} |", correlation) : " – |";
    }
    text += "\n";
  }
  text +=
      fmt::format("\n{} measurements, {} parameters; condition of the cost's curvature: {:.3g}\n",
                  result.measurements, result.parameters.size(), result.condition);
  if (result.determined()) return text + "the data determine all fitted parameters\n";
  std::string open;
  for (const FittedParameter& fitted : result.parameters) {
    if (fitted.relative_error < FitResult::kLargestError) continue;
    open.append(open.empty() ? "" : ", ").append(fitted.parameter.name);
  }
  return text + "the data do not determine " +
         (open.empty() ? std::string("all combinations of these parameters") : open) +
         ": fit fewer parameters, or add data\n";
}

/// The complete scene, with what was fitted at its top.
std::string scene_of(const FitCommand& command, const Scene& scene, const FitResult& result) {
  std::string text =
      "# Made by merkel fit " + printable_text(command.scene) +
      (command.data.empty() ? "" : " --data " + printable_text(command.data)) +
      fmt::format("; cost {:.3f} Hz², before {:.3f} Hz².\n", result.cost_after, result.cost_before);
  for (const FittedParameter& fitted : result.parameters) {
    text += fmt::format("# fitted: {}.{} = {:.6g}, before {:.6g}\n", fitted.parameter.table,
                        fitted.parameter.key, fitted.after, fitted.before);
  }
  return text + scene_text(scene);
}

/// Fits, changes the scene, writes it, and returns the report. A scene that cannot be written
/// leaves its reason in `failure`, so that the report is not lost.
Expected<std::string, SetupError> fit_and_write(const FitCommand& command, Scene& scene,
                                                const Recordings& recordings, OutputFile& out,
                                                std::string& failure, const ReportFolder& folder) {
  std::vector<std::string> names = command.parameters;
  if (names.empty()) names = {"gain_Hz_per_kPa", "fast_weight", "slow_weight"};
  const auto result = fit(
      scene.model, recordings.sets, names, static_cast<std::size_t>(command.trials),
      static_cast<int>(command.evaluations),
      [&](double share) {
        folder.report(share);
        return true;
      },
      jobs_or_cores(command.threads));
  if (!result) return Unexpected<SetupError>(result.error());
  set_fitted(scene.model, *result);
  if (!out.write(scene_of(command, scene, *result)) || !out.close()) {
    failure = out.error();
    return report_of(*result);
  }
  const std::string data = command.data.empty() ? "" : " --data " + command.data;
  return report_of(*result) + "\nwrote " + command.out + "; evaluate it with merkel score " +
         command.out + data + "\n";
}

int fit_command(const FitCommand& command) {
  auto scene = scene_named(command.scene);
  if (!scene) return refuse(scene.error());
  const auto recordings = recordings_named(command.data, scene->probes.front().input.contact);
  if (!recordings) return refuse(recordings.error());
  const bool compares = !recordings->trials.empty();
  if (!command.report.empty() && !compares) {
    return refuse(
        "--report compares recorded presses, but the data have no section trials: add "
        "them, or leave out --report");
  }
  const ReportFolder folder{.folder = command.report.empty() ? "fit" : command.report,
                            .file = "fit.md",
                            .overwrite = command.overwrite};
  if (compares) {
    // Before a fit of minutes: --out may be in the folder, and no table may be in the way.
    std::error_code ignored;
    std::filesystem::create_directories(folder.folder, ignored);
    for (const auto& [table, columns] : kTrialTables) {
      const std::string path = folder.path(table);
      if (auto free = check_writable(path, command.overwrite); !free) return refuse(free.error());
    }
  }
  auto out = OutputFile::create(command.out, command.overwrite);
  if (!out) return refuse(out.error());
  std::string failure;
  const ReportPart parts[] = {
      {"fit",
       {},
       [&](const ReportFolder& to, ReportTables& /*tables*/) {
         return fit_and_write(command, *scene, *recordings, *out, failure, to);
       }},
      {"recorded presses", kTrialTables,
       [&](const ReportFolder& /*to*/, ReportTables& tables) -> Expected<std::string, SetupError> {
         auto text = score_trials(scene->model, *recordings,
                                  static_cast<std::size_t>(command.trials), tables);
         if (!text) return text;
         return "\n## Recorded presses and the spikes of the fitted scene\n\n" + *text;
       }}};
  const std::string heading = "# Fit of " + command.scene + " to " +
                              (command.data.empty() ? "published recordings" : command.data) +
                              "\n\n";
  const std::span<const ReportPart> all(parts);
  const int code =
      compares ? make_report(folder, heading, all, "score") : print_report(heading, all.first(1));
  return failure.empty() ? code : fail(failure);
}

}  // namespace

void add_fit_command(CommandLine& program) {
  auto command = std::make_shared<FitCommand>();
  CommandLine fit = program.subcommand(
      "fit",
      "Fits the gain and the two adaptation weights (or other parameters) to recordings, "
      "reports the cost before and after and how well the data determine each parameter, "
      "and writes a complete scene. Recorded presses are also compared spike by spike.",
      "fit goodwin --out fitted.toml");
  fit.option("scene", command->scene,
             "Scene file (TOML) or preset to start from; default goodwin. Its afferents are driven "
             "by energy density, as those of goodwin and finger")
      .option("--data", command->data,
              "Recordings (JSON; format in tools/README.md) instead of the published ones")
      .option("--out", command->out, "Scene to write (TOML)")
      .option("--report", command->report,
              "Folder for the comparison with recorded presses (section trials of the data): rates "
              "by phase, PSTH, spike distances, phase locking, tables and pictures; default fit")
      .list(
          "--parameter", command->parameters,
          "Parameter to fit, repeatable: gain_Hz_per_kPa, fast_weight, slow_weight (default: "
          "these three), fast_ms, slow_ms, field_radius_mm (of one's own afferent; takes minutes), tau_ms, "
          "refractory_ms, compression_ms, noise")
      .option("--trials", command->trials, "Repetitions of each press", {1, 1000})
      .option("--evaluations", command->evaluations, "Maximum number of evaluations of the model",
              {10, 100000})
      .option("--jobs", command->threads, kThreadsHelp, {1, 1024})
      .flag("--overwrite", command->overwrite, "Replace existing files")
      .runs([command] { return fit_command(*command); });
  add_fit_skin_command(fit);
}

}  // namespace merkel
