#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/sessions/session_reader.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "tools/commands/command.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {
namespace {

struct ExportOptions {
  std::string session;
  std::vector<std::string> sinks;
  std::string time_zero = "session";
  bool overwrite = false;
  bool allow_remote = false;
};

int export_session(const ExportOptions& options) {
  if (options.time_zero != "session" && options.time_zero != "unix" &&
      options.time_zero != "device") {
    return refuse("--time-zero " + options.time_zero + " is not one of session, unix, device");
  }
  auto session = SessionReader::open(options.session);
  if (!session) return refuse(session.error());
  // Samples that were recorded without a simulation have no scene, and no spikes.
  std::optional<Scene> scene;
  std::optional<TactileModel> model;
  std::optional<SessionNumbering> numbering;
  if (!session->fact("scene_text").empty()) {
    auto of_session = scene_of_session(*session);
    if (!of_session) return refuse(of_session.error());
    scene = std::move(*of_session);
    auto made = TactileModel::create(scene->model);
    if (!made) return refuse(scene->sentence(made.error()));
    model = std::move(*made);
    numbering.emplace(*session, *model);
  }
  const auto run = describe_session(options.session, *session, scene ? &*scene : nullptr,
                                    model ? &*model : nullptr);
  if (!run) return refuse(run.error());
  const auto neurons = static_cast<std::uint32_t>(model ? model->neurons() : 0);
  std::vector<std::unique_ptr<Sink>> sinks;
  for (const std::string& uri : options.sinks) {
    auto sink = open_sink(uri, {.neurons = neurons,
                                .overwrite = options.overwrite,
                                .allow_remote = options.allow_remote,
                                .run = *run,
                                .notice = warn,
                                .inputs = {split_rig(options.session).first},
                                .time_zero = options.time_zero == "unix"     ? TimeZero::kUnix
                                             : options.time_zero == "device" ? TimeZero::kDevice
                                                                             : TimeZero::kRun});
    if (!sink) return refuse(sink.error());
    sinks.push_back(std::move(*sink));
  }
  const auto origin = session_origin(*session);
  if (!origin) return refuse(origin.error());
  for (const auto& sink : sinks) {
    if (auto started = sink->begin(*origin); !started) return fail(started.error().sentence);
  }
  SessionChunk chunk;
  std::uint64_t spikes = 0;
  for (;;) {
    const auto more = session->next(chunk);
    if (!more) return refuse(more.error());
    if (!*more) break;
    if (numbering) numbering->apply(chunk);
    for (const SpikeEvent& spike : chunk.spikes) {
      if (spike.neuron >= 1 && spike.neuron <= neurons) continue;
      return refuse(options.session + " has a spike of neuron " + std::to_string(spike.neuron) +
                    ", which its scene does not have: the session is damaged");
    }
    for (const StimulationCommand& command : chunk.commands) {
      if (scene && command.electrode < scene->encoding.electrodes.size()) continue;
      return refuse(options.session + " has a command for electrode " +
                    std::to_string(command.electrode + 1) +
                    ", which its scene does not have: the session is damaged");
    }
    spikes += chunk.spikes.size();
    for (const auto& sink : sinks) {
      if (auto written = sink->write(batch_of(chunk)); !written) {
        return fail(written.error().sentence);
      }
    }
  }
  for (const auto& sink : sinks) {
    if (auto closed = sink->close(); !closed) return fail(closed.error().sentence);
    if (sink->takes<SpikeEvent>() && sink->delivered() < spikes) {
      std::fprintf(stderr, "merkel: %s: %llu of %llu spikes did not arrive\n", sink->uri().c_str(),
                   static_cast<unsigned long long>(spikes - sink->delivered()),
                   static_cast<unsigned long long>(spikes));
    }
  }
  std::fprintf(stderr, "%llu spikes exported%s\n", static_cast<unsigned long long>(spikes),
               session->complete() ? "" : "; the recording is incomplete and ends there");
  return kDone;
}

}  // namespace

void add_export_command(CommandLine& program) {
  auto options = std::make_shared<ExportOptions>();
  program
      .subcommand("export",
                  "Converts a recorded session to other formats, by any of the sinks: spikes, "
                  "stimulus, positions, events and marks, as far as the format can hold them.",
                  "export session.xdf --sink nwb:session.nwb --sink trace:press.csv")
      .option(
          "session", options->session,
          "Session, as recorded by --sink xdf:FILE; FILE@RIG for a rig in a file of LabRecorder")
      .required()
      .list("--sink", options->sinks, "Sink URI, repeatable: " + sink_schemes())
      .required()
      .option("--time-zero", options->time_zero,
              "Zero of the times in files: session (its start), unix (1970-01-01) or "
              "device (the probe's own time)")
      .flag("--overwrite", options->overwrite, "Replace existing files")
      .flag("--allow-remote", options->allow_remote,
            "Allow sinks to send to other machines and to be reached from them")
      .runs([options] { return export_session(*options); });
}

}  // namespace merkel
