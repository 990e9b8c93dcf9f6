#include "tools/commands/inspect.hpp"

#include <cstdio>
#include <memory>

#include "tools/commands/command.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

int inspect_receptors(const InspectOptions& options) {
  const auto scene = scene_of(options);
  if (!scene) return refuse(scene.error());
  const auto& patches = scene->model.patches;
  const bool several = patches.size() > 1;
  std::printf("receptor,x_mm,y_mm,neuron%s\n", several ? ",patch" : "");
  for (const PatchParameters& patch : patches) {
    const auto receptors = place_receptors(patch.receptors, patch.patch);
    if (!receptors) return refuse(scene->sentence(receptors.error()));
    std::size_t number = 0;
    for (const Receptor& receptor : *receptors) {
      std::printf("%zu,%.12g,%.12g,%u", ++number, receptor.x_mm, receptor.y_mm, receptor.neuron);
      std::printf(several ? ",%s\n" : "\n", patch.name.c_str());
    }
  }
  return kDone;
}

}  // namespace

Expected<Scene, SetupError> scene_of(const InspectOptions& options) {
  auto scene = scene_named(options.scene);
  if (!scene) return scene;
  Indenter& indenter = scene->model.indenters.front();
  indenter.radius_mm = options.radius_mm.value_or(indenter.radius_mm);
  const auto checked = ParameterCheck()
                           .also(scene->model.skin.check())
                           .also(indenter.check(scene->model.skin))
                           .result();
  if (!checked) return bad_input(scene->sentence(checked.error()));
  return scene;
}

void add_inspect_command(CommandLine& program) {
  auto options = std::make_shared<InspectOptions>();
  CommandLine command = program.subcommand(
      "inspect", "Prints the parts of the model, or of a recorded session, by themselves, as CSV.",
      "inspect contact --radius-mm 2 --depth-mm 1.5");
  command.require_subcommand();

  CommandLine contact =
      command.subcommand("contact", "Contact radius, force and peak pressure of a press.",
                         "inspect contact --radius-mm 2 --depth-mm 1.5");
  CommandLine field =
      command.subcommand("field", "Stress and strain energy density under a press.",
                         "inspect field --radius-mm 2 --depth-mm 1.5 --r-mm 0,1,2 --z-mm 0.65");
  for (CommandLine* const press : {&contact, &field}) {
    press->option("--radius-mm", options->radius_mm, "Radius of the sphere, mm", {-1e9, 1e300})
        .option("--depth-mm", options->depth_mm, "Indentation depth, mm", {0.0, 1e3})
        .option("--force-N", options->force_N, "Force, N", {0.0, 1e4})
        .option("--scene", options->scene, "Scene whose skin and tip to take");
  }
  contact.runs([options] { return inspect_contact(*options); });
  field
      .list("--r-mm", options->r_mm,
            "Distances from the axis, mm, separated by commas; under bars, x on the middle line",
            {0.0, 1e6})
      .required()
      .list("--z-mm", options->z_mm, "Depths below the surface, mm, separated by commas",
            {0.0, 1e6})
      .flag("--printed", options->printed,
            "Instead: the paper's printed form, a point load seen from the depth z = U(r)")
      .runs([options] { return inspect_field(*options); });

  command
      .subcommand("neuron", "Spike times of one neuron under an injected current.",
                  "inspect neuron --current 10 --duration-ms 200 --method rk4 --step-us 5")
      .option("--current", options->current, "Constant current from 0 ms, µA/cm²", {-1e6, 1e6})
      .list("--ramp", options->ramp,
            "t0,t1,t2,t3,I: rises from t0 to t1, falls from t2 to t3 (ms); I in µA/cm²",
            {-1e9, 1e9}, 5)
      .option("--duration-ms", options->duration_ms, "How long, ms", {1e-3, 1e9})
      .option("--method", options->method, "Integration method")
      .option("--step-us", options->step_us, "Membrane step, µs", {1e-3, 1e6})
      .list("--set", options->settings, "NAME=NUMBER, for example gCaL=0; repeatable")
      .option("--scene", options->scene, "Scene whose neuron to take")
      .runs([options] { return inspect_neuron(*options); });

  command
      .subcommand("receptors", "The receptors of a scene, as they are drawn.",
                  "inspect receptors scene.toml")
      .option("scene", options->scene, "Scene file or preset")
      .runs([options] { return inspect_receptors(*options); });
  add_inspect_session_command(command);
}

}  // namespace merkel
