#include "tools/commands/inspect.hpp"

#include <cstdio>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/model_fields.hpp"
#include "core/scene/patch_layout.hpp"
#include "tools/commands/command.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

enum class PatchColumn { kOfSeveral, kAlways };

/// Calls print(layout, number of afferents in earlier patches, ",PATCH" or "") for each patch.
template <class Print>
int for_each_layout(const InspectOptions& options, const char* columns, PatchColumn column,
                    Print print) {
  const auto scene = scene_of(options);
  if (!scene) return refuse(scene.error());
  std::vector<PatchLayout> layouts;
  for (const PatchParameters& patch : scene->model.patches) {
    auto layout = layout_of(patch);
    if (!layout) return refuse(scene->sentence(layout.error()));
    layouts.push_back(std::move(*layout));
  }
  const bool named = column == PatchColumn::kAlways || layouts.size() > 1;
  std::printf("%s%s\n", columns, named ? ",patch" : "");
  std::size_t before = 0;
  for (std::size_t i = 0; i < layouts.size(); ++i) {
    const std::string& name = scene->model.patches[i].name;
    print(layouts[i], before, named ? "," + (name.empty() ? std::to_string(i) : name) : "");
    before += layouts[i].afferents.size();
  }
  return kDone;
}

int inspect_receptors(const InspectOptions& options) {
  return for_each_layout(
      options, "receptor,x_mm,y_mm,neuron", PatchColumn::kOfSeveral,
      [](const PatchLayout& layout, std::size_t before, const std::string& patch) {
        std::size_t number = 0;
        for (const Receptor& receptor : layout.receptors) {
          std::printf("%zu,%.12g,%.12g,%zu%s\n", ++number, receptor.x_mm, receptor.y_mm,
                      before + receptor.neuron, patch.c_str());
        }
      });
}

int inspect_afferents(const InspectOptions& options) {
  return for_each_layout(
      options, "neuron,x_mm,y_mm,field_radius_mm,receptors", PatchColumn::kAlways,
      [](const PatchLayout& layout, std::size_t before, const std::string& patch) {
        std::size_t number = before;
        for (const AfferentSite& site : layout.afferents) {
          std::printf("%zu,%.12g,%.12g,%.12g,%zu%s\n", ++number, site.x_mm, site.y_mm,
                      site.radius_mm, site.receptors, patch.c_str());
        }
      });
}

}  // namespace

Expected<Scene, SetupError> scene_of(const InspectOptions& options) {
  auto scene = scene_named(options.scene);
  if (!scene) return scene;
  Indenter& indenter = scene->model.indenters.front();
  if (options.radius_mm) {
    if (indenter.sphere() == nullptr && !std::holds_alternative<CylinderTip>(indenter.tip)) {
      return bad_input("--radius-mm is that of a sphere, but the tip of the scene is \"" +
                       std::string(indenter.tip_name()) + "\": leave it out");
    }
    for (const BoundField& key : tip_fields(indenter)) {
      if (key.field->key == "radius_mm") *std::get<double*>(key.value) = *options.radius_mm;
    }
  }
  const auto checked = ParameterCheck()
                           .also(scene->model.skin.check())
                           .also(indenter.check(scene->model.skin))
                           .result();
  if (!checked) return bad_input(scene->sentence(checked.error()));
  return scene;
}

void add_inspect_command(CommandLine& program) {
  auto options = std::make_shared<InspectOptions>();
  CommandLine command =
      program.subcommand("inspect", "Prints parts of the model or of a recorded session as CSV.",
                         "inspect contact --radius-mm 2 --depth-mm 1.5");
  command.require_subcommand();

  CommandLine contact = command.subcommand(
      "contact",
      "Force, size and peak pressure of a press; for a solved contact without a depth or force, at "
      "all depths of its tables.",
      "inspect contact --radius-mm 2 --depth-mm 1.5");
  CommandLine field =
      command.subcommand("field", "Stress and strain energy density under a press.",
                         "inspect field --radius-mm 2 --depth-mm 1.5 --r-mm 0,1,2 --z-mm 0.65");
  for (CommandLine* const press : {&contact, &field}) {
    press
        ->option("--radius-mm", options->radius_mm, "Radius of the sphere, mm (inf: a plate)",
                 {-1e9, std::numeric_limits<double>::infinity()})
        .option("--depth-mm", options->depth_mm, "Indentation depth, mm", {0.0, 1e3})
        .option("--force-N", options->force_N, "Force, N", {0.0, 1e4})
        .option("--scene", options->scene, "Scene whose skin and tip are used");
  }
  contact
      .option("--draw", options->folder,
              "Folder for a table and a picture of a solved contact: tip, pressure, energy density")
      .runs([options] { return inspect_contact(*options); });
  field
      .list("--r-mm", options->r_mm,
            "Positions x on the line through the centre of the press, mm, separated by commas; 0 "
            "is the axis",
            {-1e6, 1e6})
      .required()
      .list("--z-mm", options->z_mm, "Depths below the surface, mm, separated by commas",
            {0.0, 1e6})
      .flag("--printed", options->printed,
            "Use the paper's printed formula instead: a point load seen from the depth z = U(r)")
      .runs([options] { return inspect_field(*options); });

  command
      .subcommand("neuron", "Spike times of one neuron under an injected current.",
                  "inspect neuron --current 10 --duration-ms 200 --method rk4 --step-us 5")
      .option("--current", options->current, "Constant current from 0 ms, µA/cm²", {-1e6, 1e6})
      .list("--ramp", options->ramp,
            "t0,t1,t2,t3,I: rises from t0 to t1, falls from t2 to t3 (ms); I in µA/cm²",
            {-1e9, 1e9}, 5)
      .option("--duration-ms", options->duration_ms, "Duration, ms", {1e-3, 1e9})
      .option("--method", options->method, "Integration method")
      .option("--step-us", options->step_us, "Membrane step, µs", {1e-3, 1e6})
      .list("--set", options->settings, "NAME=NUMBER, for example g_CaL=0; repeatable")
      .option("--scene", options->scene, "Scene whose neuron parameters are used")
      .runs([options] { return inspect_neuron(*options); });

  command
      .subcommand("receptors",
                  "The receptors of a scene, in the order in which their positions are generated.",
                  "inspect receptors scene.toml")
      .option("scene", options->scene, "Scene file or preset")
      .runs([options] { return inspect_receptors(*options); });
  command
      .subcommand(
          "afferents",
          "The afferents of a scene: number, centre and radius of the receptive field (of a "
          "subregion: its circumscribed circle), receptors, and patch (name, or number from 0).",
          "inspect afferents goodwin")
      .option("scene", options->scene, "Scene file or preset")
      .runs([options] { return inspect_afferents(*options); });
  command
      .subcommand("encoding",
                  "The stimulation commands that a scene's electrodes get for its recorded or "
                  "simulated probes. Research software; makes no claim about safety or percepts.",
                  "inspect encoding scene.toml --probe sim:taps")
      .option("scene", options->scene, "Scene file with [[electrode]] and [stimulation]")
      .list("--probe", options->probes, "Probe URI instead of the scene's: replay:, sim:")
      .option("--duration-s", options->duration_s, "Stop after this probe time in seconds",
              {1e-6, 1e9})
      .runs([options] { return inspect_encoding(*options); });
  add_inspect_session_command(command);
}

}  // namespace merkel
