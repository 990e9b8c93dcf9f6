#include <cstdio>
#include <memory>
#include <string>
#include <variant>

#include "core/parameters/nearest_name.hpp"
#include "drivers/sessions/session_samples.hpp"
#include "tools/commands/command.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

struct SceneCommand {
  std::string scene = "paper";
  bool keys = false;
  bool list = false;
};

/// The text of a session's scene names the files of its shapes, which may hold others by now.
void note_shapes(const Scene& scene, const std::string& session) {
  for (const auto& indenter : scene.model.indenters) {
    const auto* const shape = std::get_if<ShapeTip>(&indenter.tip);
    if (shape == nullptr || !SessionSamples::is_session(session)) continue;
    warn(session + " holds the heights of " + shape->file +
         ", of which this text has the name alone: merkel bundle " + session +
         " --out FOLDER writes both");
  }
}

int print_scene(const SceneCommand& command) {
  if (command.keys) {
    std::fputs(scene_keys_text().c_str(), stdout);
    return kDone;
  }
  if (command.list) {
    const std::string examples = example_scene_list("  ", ": ");
    std::fputs(("presets:\n" + preset_list("  ", ": ") + "examples:\n" +
                (examples.empty() ? "  (not installed beside this program)\n" : examples) +
                "Each name is a scene of merkel run, plan and scene.\n")
                   .c_str(),
               stdout);
    return kDone;
  }
  const auto scene = scene_named(command.scene);
  if (!scene) return refuse(scene.error());
  std::fputs(scene_text(*scene).c_str(), stdout);
  note_shapes(*scene, command.scene);
  return kDone;
}

}  // namespace

void add_scene_command(CommandLine& program) {
  auto command = std::make_shared<SceneCommand>();
  program
      .subcommand("scene",
                  "Prints a preset or a scene file as a complete, commented scene file: every key "
                  "with its value, unit, range and meaning. Presets: " +
                      listed(preset_names()) + ".",
                  "scene goodwin > my.toml; merkel run my.toml")
      .option("scene", command->scene, "Preset, example or scene file (TOML)")
      .flag("--list", command->list, "Print the presets and the examples, a line each, instead")
      .flag("--keys", command->keys,
            "Print all keys of scene files instead, with unit, range, default and meaning "
            "(Markdown)")
      .notes("Presets:\n" + preset_list("  ", ": "))
      .runs([command] { return print_scene(*command); });
}

}  // namespace merkel
