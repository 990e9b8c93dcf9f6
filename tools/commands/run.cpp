#include "tools/commands/run.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/parameters/nearest_name.hpp"
#include "core/scene/tactile_model.hpp"
#include "core/units.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "drivers/probes/replay_probe.hpp"
#include "drivers/probes/sim_probe.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "drivers/sinks/recording_switch.hpp"
#include "drivers/uri.hpp"
#include "realtime/pipeline.hpp"
#include "tools/commands/command.hpp"
#include "tools/run/crash_report.hpp"
#include "tools/run/endless_touch.hpp"
#include "tools/run/long_work.hpp"
#include "tools/run/run_summary.hpp"
#include "tools/run/service_notice.hpp"
#include "tools/run/status_line.hpp"
#include "tools/run/stimulation_control.hpp"
#include "tools/run/stop_signal.hpp"
#include "tools/run/verdict.hpp"
#include "tools/scene/prepared_run.hpp"
#include "tools/scene/scene_overrides.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/scene/session_scene.hpp"
#include "tools/studies/plan/plan_report.hpp"

namespace merkel {
namespace {

constexpr double kShortDemonstration_s = 20.0;

bool is_recorded(const std::string& uri) {
  return uri.starts_with("sim:") || uri.starts_with("replay:");
}

/// Plays the scene's recordings and simulated presses without end.
Expected<void, SetupError> repeat(Scene& scene, bool bounded) {
  if (!bounded) return bad_input("--repeat with --fast never ends: add --duration-s");
  bool any = false;
  const auto set = [&any](std::string& uri) {
    if (!is_recorded(uri)) return;
    any = true;
    const std::string whole = split_fragment(uri).first;
    const auto parsed = Uri::parse(whole);
    if (!parsed || parsed->options.contains("repeat")) return;
    uri = whole + (parsed->options.empty() ? "?" : "&") + "repeat=0" + uri.substr(whole.size());
  };
  for (Scene::ProbeSettings& probe : scene.probes) set(probe.uri);
  for (Scene::OfDevice& device : scene.devices) set(device.uri);
  if (any) return {};
  return bad_input("--repeat: no probe of the scene is a recording or a simulated press");
}

Expected<Scene, SetupError> scene_of(const RunOptions& options) {
  auto scene = scene_named(options.scene);
  if (!scene) return scene;
  const auto overrides = overrides_of(options.set);
  if (!overrides) return Unexpected<SetupError>(overrides.error());
  scene = with_overrides(*scene, *overrides);
  if (!scene) return scene;
  if (!options.probes.empty()) {
    if (auto set = set_probes(*scene, options.probes); !set) {
      return Unexpected<SetupError>(set.error());
    }
  }
  scene->sinks.insert(scene->sinks.end(), options.sinks.begin(), options.sinks.end());
  if (!options.record.empty()) {
    scene->sinks.push_back((options.record.ends_with(".xdf") ? "xdf:" : "trace:") + options.record);
  }
  if (options.seed) scene->set_seed(*options.seed);
  if (options.repeat) {
    if (auto set = repeat(*scene, !options.fast || options.duration_s); !set) {
      return Unexpected<SetupError>(set.error());
    }
  }
  return scene;
}

/// Prints what happens while the pipeline runs, and reports progress to the service manager.
void report_on(TerminalLine& terminal, ServiceNotice& service, Pipeline::Parameters& parameters) {
  parameters.on_sink_failure = [&](const std::string& uri, const std::string& error_message) {
    terminal.print_line("merkel: the sink " + uri +
                        " was closed and the run continues: " + error_message);
  };
  parameters.on_notice = [&](const std::string& sentence) {
    terminal.print_line("merkel: " + sentence);
  };
  parameters.on_missing_right = [&](const std::string& sentence) {
    terminal.print_line("merkel: note: " + sentence);
  };
  parameters.on_progress = [&, fast = parameters.fast, line = StatusLine(), long_run = LongRun(),
                            endless = EndlessTouch()](const RunProgress& progress) mutable {
    service.progress(progress.counters);
    for (const std::string& sentence : endless.sentences(progress)) {
      terminal.print_line("merkel: " + sentence);
    }
    if (terminal.on_terminal()) {
      terminal.show(line.fields(progress));
    } else if (fast) {
      long_run.report(progress);
    }
  };
}

/// Prints the summary. \return the exit code
int conclude(const RunOptions& options, const PreparedRun& prepared, const Json& plan,
             const RunReport& report) {
  const TactileModel& model = *prepared.model;
  const Json facts = summary_json(report, model, plan, prepared.scene);
  const std::string summary = options.json ? json_text(facts) : summary_text(facts, options.all);
  const auto& sinks = prepared.scene.sinks;
  const bool data_on_stdout = std::any_of(sinks.begin(), sinks.end(), writes_standard_output);
  std::fputs(summary.c_str(), data_on_stdout ? stderr : stdout);
  const bool page = std::any_of(sinks.begin(), sinks.end(),
                                [](const std::string& uri) { return uri.starts_with("view:"); });
  const double run_s = static_cast<double>(report.ticks) * units::s_from(model.parameters().tick);
  if (page && !report.interrupted && !options.duration_s && run_s < kShortDemonstration_s) {
    std::fprintf(stderr,
                 "merkel: note: the live page ended with the run, after %.1f s: with --repeat, "
                 "recordings and simulated presses play again until Ctrl-C\n",
                 run_s);
  }
  if (const std::string failure = report.failure(); !failure.empty()) {
    return report.bad_input ? refuse(failure) : fail(failure);
  }
  return failed(verdict_of(report, model), options.strict) ? kFailed : kDone;
}

/// Says what a long set-up waits for. Devices may take longer than a model to be ready.
LongWork set_up_notice(const Scene& scene) {
  bool device = false;
  for (std::size_t i = 0; i < scene.probes.size(); ++i) {
    const std::string uri = scene.uri_of(i);
    device = device || !(uri.starts_with("sim:") || uri.starts_with("replay:"));
  }
  return LongWork("still setting up " + contents_of(scene) +
                      (device ? ": a device may not have sent a reading yet; otherwise the time "
                                "grows"
                              : ": the time grows") +
                      " with the number of different tips, of receptors and of patches",
                  std::chrono::seconds{device ? 3 : 1});
}

}  // namespace

int run_scene(Scene scene, const RunOptions& options) {
  std::optional<Plan> plan;
  if (scene.spike_time_us) {
    auto made = make_plan(scene);
    if (!made) return refuse(made.error());
    plan = std::move(*made);
  }
  auto prepared = [&] {
    const LongWork notice = set_up_notice(scene);
    return prepare_run(std::move(scene),
                       {.fast = options.fast, .allow_remote = options.allow_remote});
  }();
  if (!prepared) return refuse(prepared.error());
  for (const std::string& notice : prepared->notices) warn("note: " + notice);
  const TactileModel& model = *prepared->model;
  Pipeline::Parameters& parameters = prepared->parameters;
  if (options.duration_s) parameters.duration = units::nanoseconds_from_s(*options.duration_s);
  TerminalLine terminal;
  ServiceNotice service;
  report_on(terminal, service, parameters);
  RunDescription& description = prepared->description;
  if (!options.record.empty()) {
    description.facts.emplace_back("command", "merkel run --probe '" + description.probes[0].uri +
                                                  "' --record " + options.record);
  }
  std::unique_ptr<Pipeline> pipeline;
  StopSignal stop;
  auto made = prepared->pipeline_to(
      prepared->scene.sinks,
      {.overwrite = options.overwrite,
       .allow_remote = options.allow_remote,
       .progress = warn,
       .recording = std::make_shared<RecordingSwitch>()},
      [](const std::string& address) { std::fprintf(stderr, "live page: %s\n", address.c_str()); });
  if (!made) return refuse(made.error());
  pipeline = std::move(*made);
  stop.reach(*pipeline);
  std::optional<StimulationControl> control;
  if (parameters.encoder != nullptr) control.emplace(pipeline->stimulation());
  const CrashWatch watch(pipeline->statistics(), model.parameters().tick);
  const auto report = pipeline->run();
  terminal.clear();
  if (!report) return refuse(report.error());
  return conclude(options, *prepared, plan ? prediction_json(*plan) : Json(), *report);
}

void add_run_command(CommandLine& program) {
  auto options = std::make_shared<RunOptions>();
  program
      .subcommand(
          "run",
          "Runs a scene: reads its probes, simulates the afferents, sends their spikes to "
          "the sinks and prints a summary. Default scene: the preset paper (Yao & Wang 2019: a "
          "sphere of 2 mm radius on a fingertip). Default probe: a 1.5 mm ramp-and-hold.",
          "run --fast --probe 'sim:taps?count=6' --sink csv:spikes.csv")
      .option("scene", options->scene,
              "Scene file (TOML), an example (merkel scene --list), or a preset: " +
                  listed(preset_names()))
      .list("--probe", options->probes,
            "Probe URI, once for each of the scene's probes: replay:FILE, sim:SHAPE, "
            "serial:DEVICE?protocol=NAME, hid:VID:PID, usb:VID:PID, udp:HOST:PORT?protocol=NAME, "
            "tcp:HOST:PORT?protocol=NAME, lsl:NAME, comedi:/dev/comedi0?columns=force_V, "
            "redis:HOST:PORT?stream=NAME, fused:URI|URI. "
            "#CHANNEL at its end, for example "
            "#thumb_N, chooses a channel of a device with several, which is opened once")
      .list("--set", options->set,
            "KEY=VALUE, repeatable: another value of a key of the scene, for example "
            "--set skin.radius_mm=8 --set probe[1].x_mm=12 (merkel scene --keys)")
      .list("--sink", options->sinks, "Sink URI, repeatable: " + sink_schemes())
      .option(
          "--record", options->record,
          "Trace (.csv) or session (.xdf) to write the probe's samples to. Its replay gives the "
          "same spikes. Same as --sink trace:FILE or xdf:FILE")
      .flag("--fast", options->fast,
            "Run as fast as possible, with the same spikes (recordings and simulated presses only)")
      .flag("--repeat", options->repeat,
            "Play recordings and simulated presses again and again, until Ctrl-C or --duration-s")
      .option("--duration-s", options->duration_s, "Stop after this probe time, s", {1e-6, 1e9})
      .option("--seed", options->seed,
              "Seed of the receptors, the network's weights and the neurons' noise")
      .flag("--json", options->json, "Print the summary as JSON")
      .flag("--all", options->all,
            "Print all afferents in the summary, not only the ten with the highest rates")
      .flag(
          "--strict", options->strict,
          "Also exit with 1 if samples or single ticks were lost, if more than 1 % of the ticks held the last sample of a device, or if "
          "ticks ended late")
      .flag("--overwrite", options->overwrite, "Replace existing files")
      .flag("--allow-remote", options->allow_remote,
            "Allow sinks to send to other machines and to be reached from them, and other machines "
            "to send samples (udp:0.0.0.0:PORT)")
      .notes(std::string(kSimProbeHelp) + "\n" + kReplayProbeHelp + "\n" + sink_options_help())
      .runs([options] {
        auto scene = scene_of(*options);
        return scene ? run_scene(std::move(*scene), *options) : refuse(scene.error());
      });
}

}  // namespace merkel
