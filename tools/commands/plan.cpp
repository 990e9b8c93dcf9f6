#include <cstdio>
#include <memory>

#include "tools/commands/command.hpp"
#include "tools/filled_text.hpp"
#include "tools/run/long_work.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/scene/session_scene.hpp"
#include "tools/studies/plan/plan_report.hpp"

namespace merkel {
namespace {

struct PlanCommand {
  std::string scene;
  std::vector<std::string> probes;
  std::optional<double> spike_time_us;
  bool json = false;
};

int plan(const PlanCommand& command) {
  auto scene = scene_named(command.scene);
  if (!scene) return refuse(scene.error());
  if (!command.probes.empty()) {
    if (auto set = set_probes(*scene, command.probes); !set) return refuse(set.error());
  }
  if (command.spike_time_us) scene->spike_time_us = command.spike_time_us;
  const auto made = [&] {
    const LongWork notice(
        "still rehearsing " + contents_of(*scene) +
        ": the reference takes RK4 steps of at most 2.5 µs with every neuron, at rest or not");
    return make_plan(*scene);
  }();
  if (!made) return refuse(made.error());
  const Json facts = plan_json(*made);
  std::fputs((command.json ? json_text(facts) : filled_text("plan", facts)).c_str(), stdout);
  return kDone;
}

}  // namespace

void add_plan_command(CommandLine& program) {
  auto command = std::make_shared<PlanCommand>();
  program
      .subcommand(
          "plan",
          "Prints what a scene will compute, what it skips and why, the predicted cost of a "
          "tick and the spike-time error. With a limit for that error, selects the "
          "cheapest method that meets the limit, as merkel run does.",
          "plan --spike-time-us 50")
      .option("scene", command->scene, "Scene file (TOML) or preset")
      .list("--probe", command->probes, "Probe URI, once for each of the scene's probes")
      .option("--spike-time-us", command->spike_time_us,
              "Largest rms error of spike times, µs; overrides the scene's", {1e-6, 1e6})
      .flag("--json", command->json, "Print the plan as JSON")
      .runs([command] { return plan(*command); });
}

}  // namespace merkel
