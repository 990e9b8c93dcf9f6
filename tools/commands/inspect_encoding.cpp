#include <string>
#include <utility>

#include "core/units.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "realtime/pipeline.hpp"
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
  Pipeline pipeline(*prepared->model, prepared->parameters);
  prepared->add_probes_to(pipeline);
  auto sink =
      open_sink("stim-csv:-", {.neurons = static_cast<std::uint32_t>(prepared->model->neurons()),
                               .run = prepared->description});
  if (!sink) return refuse(sink.error());
  pipeline.add_sink(std::move(*sink));
  const auto report = pipeline.run();
  if (!report) return refuse(report.error());
  if (!report->error_message.empty()) return refuse(report->error_message);
  const std::string& error = report->sinks.front().error_message;
  return error.empty() ? kDone : fail(error);
}

}  // namespace merkel
