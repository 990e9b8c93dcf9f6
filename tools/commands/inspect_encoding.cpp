#include <string>
#include <utility>

#include "core/units.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/inspect.hpp"
#include "tools/scene/prepared_run.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {

int inspect_encoding(const InspectOptions& options) {
  auto scene = scene_of(options);
  if (!scene) return refuse(scene.error());
  if (scene->encoding.electrodes.empty()) {
    return refuse(
        "the scene has no electrodes: add [[electrode]] and [stimulation] to it (merkel scene "
        "--keys explains them)");
  }
  if (!options.probes.empty()) {
    if (auto set = set_probes(*scene, options.probes); !set) return refuse(set.error());
  }
  auto prepared = prepare_run(std::move(*scene), {.fast = true});
  if (!prepared) return refuse(prepared.error());
  if (options.duration_s) {
    prepared->parameters.duration = units::nanoseconds_from_s(*options.duration_s);
  }
  const auto report = prepared->run({"stim-csv:-"});
  if (!report) return refuse(report.error());
  const std::string failure = report->failure();
  if (failure.empty()) return kDone;
  return report->error_message.empty() ? fail(failure) : refuse(failure);
}

}  // namespace merkel
