#include "tools/studies/score/fit.hpp"

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <unistd.h>

#include "drivers/files/output_file.hpp"
#include "tools/commands/command.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/studies/report/report.hpp"

namespace merkel {
namespace {

struct FitCommand {
  std::string preset = "goodwin";
  std::string data;
  std::string out = "fitted.toml";
  std::vector<std::string> parameters;
  double trials = 16;
  double evaluations = 200;
  bool overwrite = false;
};

std::string report_of(const FitResult& result) {
  std::string text = fmt::format("cost {:.3f} Hz² before, {:.3f} Hz² after; {} evaluations\n\n",
                                 result.cost_before, result.cost_after, result.evaluations);
  text += "| parameter | before | after | standard error |";
  for (const FittedParameter& parameter : result.parameters) {
    text += " corr. with " + parameter.name + " |";
  }
  text += "\n|---|---|---|---|";
  for (std::size_t k = 0; k < result.parameters.size(); ++k) text += "---|";
  text += "\n";
  for (std::size_t k = 0; k < result.parameters.size(); ++k) {
    const FittedParameter& parameter = result.parameters[k];
    text +=
        fmt::format("| {} | {:.5g} | {:.5g} | ", parameter.name, parameter.before, parameter.after);
    // The standard error is that of ln p: a small fraction of p, or meaningless.
    text += parameter.relative_error < 1.0
                ? fmt::format("{:.1f} % |", 100.0 * parameter.relative_error)
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
  for (const FittedParameter& parameter : result.parameters) {
    if (parameter.relative_error < FitResult::kLargestError) continue;
    open.append(open.empty() ? "" : ", ").append(parameter.name);
  }
  return text + "the data do not determine " +
         (open.empty() ? std::string("all combinations of these parameters") : open) +
         ": fit fewer parameters, or add data\n";
}

std::string scene_of(const FitCommand& command, const TactileModel::Parameters& model,
                     const FitResult& result) {
  std::string text = "# Made by merkel fit " + command.preset +
                     (command.data.empty() ? "" : " --data " + command.data) +
                     fmt::format("; cost {:.3f} Hz², before {:.3f} Hz².\n", result.cost_after,
                                 result.cost_before) +
                     "preset = \"" + command.preset + "\"\n";
  for (const char* const table : {"afferent", "neuron"}) {
    std::string keys;
    for (const FittedParameter& parameter : result.parameters) {
      if (parameter.table != table) continue;
      keys += parameter.name + " = " + fmt::format("{:.6g}", parameter.after) + "\n";
      if (parameter.name != "noise") continue;
      keys += "seed = " + std::to_string(model.noise()->seed) + "\n";
    }
    if (!keys.empty()) text += "\n[" + std::string(table) + "]\n" + keys;
  }
  return text;
}

int fit_command(const FitCommand& command) {
  auto scene = preset_scene(command.preset);
  if (!scene) {
    return refuse("there is no preset \"" + command.preset +
                  "\" to start from: a fit starts from goodwin or goodwin-cs");
  }
  const auto recordings = recordings_named(command.data);
  if (!recordings) return refuse(recordings.error());
  auto out = OutputFile::create(command.out, command.overwrite);
  if (!out) return refuse(out.error());
  std::vector<std::string> names = command.parameters;
  if (names.empty()) names = {"gain_Hz_per_kPa", "fast_weight", "slow_weight"};
  std::function<void(double)> progress;
  if (::isatty(STDERR_FILENO) == 1) {
    progress = [](double fraction) { std::fprintf(stderr, "\r%3.0f %% ", 100.0 * fraction); };
  }
  const auto result =
      fit(scene->model, recordings->sets, names, static_cast<std::size_t>(command.trials),
          static_cast<int>(command.evaluations), progress);
  if (progress) std::fprintf(stderr, "\r      \r");
  if (!result) return refuse(result.error());
  std::fputs(report_of(*result).c_str(), stdout);
  if (!out->write(scene_of(command, scene->model, *result)) || !out->close()) {
    return fail(out->error());
  }
  const std::string data = command.data.empty() ? "" : " --data " + command.data;
  std::printf("\nwrote %s; evaluate it with merkel score %s%s\n", command.out.c_str(),
              command.out.c_str(), data.c_str());
  return kDone;
}

}  // namespace

void add_fit_command(CommandLine& program) {
  auto command = std::make_shared<FitCommand>();
  CommandLine fit = program.subcommand(
      "fit",
      "Fits the gain and the two adaptation weights (or other parameters) to recordings, "
      "reports the cost before and after and how well the data determine each parameter, "
      "and writes a scene.",
      "fit goodwin --out fitted.toml");
  fit.option("preset", command->preset, "Preset to start from: goodwin (default) or goodwin-cs")
      .option("--data", command->data,
              "Recordings (JSON; format in tools/README.md) instead of the published ones")
      .option("--out", command->out, "Scene to write (TOML)")
      .list("--parameter", command->parameters,
            "Parameter to fit, repeatable: gain_Hz_per_kPa, fast_weight, slow_weight (default: "
            "these three), fast_ms, slow_ms, tau_ms, refractory_ms, compression_ms, noise")
      .option("--trials", command->trials, "Repetitions of each press", {1, 1000})
      .option("--evaluations", command->evaluations, "Maximum number of evaluations of the model",
              {10, 100000})
      .flag("--overwrite", command->overwrite, "Replace existing files")
      .runs([command] { return fit_command(*command); });
  add_fit_skin_command(fit);
}

}  // namespace merkel
