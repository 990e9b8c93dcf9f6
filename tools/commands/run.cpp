#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/tactile_model.hpp"
#include "core/units.hpp"
#include "drivers/probes/limited_probe.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/probes/sim_probe.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "drivers/sinks/recording_switch.hpp"
#include "realtime/pipeline.hpp"
#include "realtime/threads/spinning_team.hpp"
#include "tools/commands/command.hpp"
#include "tools/run/crash_report.hpp"
#include "tools/run/run_summary.hpp"
#include "tools/run/service_notice.hpp"
#include "tools/run/status_line.hpp"
#include "tools/run/stop_signal.hpp"
#include "tools/run/verdict.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/scene/session_scene.hpp"
#include "tools/studies/plan/plan.hpp"

namespace merkel {
namespace {

struct RunOptions {
  std::string scene;
  std::vector<std::string> probes;
  std::vector<std::string> sinks;
  bool fast = false;
  bool json = false;
  bool all = false;
  bool overwrite = false;
  bool allow_remote = false;
  bool strict = false;
  std::string record;
  std::optional<double> duration_s;
  std::optional<std::uint64_t> seed;
};

/// Chooses the reading that drives each contact: what the scene says, else the force where every
/// probe measures it, else the depth. A force is measured at the skin; the depth that goes with it
/// depends on the finger, and on where the stage was zeroed.
Expected<void, SetupError> choose_controls(Scene& scene,
                                           std::span<const std::unique_ptr<Probe>> probes) {
  const auto has = [](const Probe& probe, std::uint32_t channel) {
    return (probe.info().channels & channel) != 0U;
  };
  const bool force = std::all_of(probes.begin(), probes.end(), [&](const auto& probe) {
    return has(*probe, ProbeSample::kForce);
  });
  for (std::size_t i = 0; i < probes.size(); ++i) {
    const auto usual = force || !has(*probes[i], ProbeSample::kDepth) ? Indenter::Control::kForce
                                                                      : Indenter::Control::kDepth;
    const auto control = scene.probes[i].control.value_or(usual);
    const bool by_depth = control == Indenter::Control::kDepth;
    if (!has(*probes[i], by_depth ? ProbeSample::kDepth : ProbeSample::kForce)) {
      return bad_input("probe.control asks for " + std::string(by_depth ? "depth" : "force") +
                       ", which the probe " + probes[i]->info().uri +
                       " does not measure: change probe.control");
    }
    scene.model.indenters[i].control = control;
  }
  return {};
}

Expected<Scene, SetupError> scene_of(const RunOptions& options) {
  auto scene = scene_named(options.scene);
  if (!scene) return scene;
  if (!options.probes.empty()) scene->set_probes(options.probes);
  scene->sinks.insert(scene->sinks.end(), options.sinks.begin(), options.sinks.end());
  if (!options.record.empty()) {
    scene->sinks.push_back((options.record.ends_with(".xdf") ? "xdf:" : "trace:") + options.record);
  }
  if (options.seed) scene->set_seed(*options.seed);
  return scene;
}

int run(const RunOptions& options) {
  auto scene = scene_of(options);
  if (!scene) return refuse(scene.error());
  std::optional<Plan> plan;
  if (scene->spike_time_us) {
    auto made = make_plan(*scene);
    if (!made) return refuse(made.error());
    plan = std::move(*made);
  }

  std::vector<std::unique_ptr<Probe>> probes;
  std::optional<std::chrono::nanoseconds> delay;
  for (std::size_t i = 0; i < scene->probes.size(); ++i) {
    auto probe = open_probe(scene->probes[i].uri);
    if (!probe) return refuse(probe.error());
    if (scene->probes[i].delay) {
      delay = std::max(delay.value_or(std::chrono::nanoseconds{0}), *scene->probes[i].delay);
    }
    probes.push_back(std::make_unique<LimitedProbe>(std::move(*probe), scene->probes[i].limits));
  }
  if (auto chosen = choose_controls(*scene, probes); !chosen) return refuse(chosen.error());
  auto model = TactileModel::create(scene->model);
  if (!model) {
    return refuse(scene->sentence(model.error()));
  }

  // Threads that spin on all cores leave none to sinks, to the system and to other programs.
  if (scene->loop.threads > 1 && scene->loop.threads == SpinningTeam::available_cores()) {
    std::fprintf(stderr,
                 "merkel: note: loop.threads = %d uses %d: one of this machine's cores is left to "
                 "others; the spikes are the same\n",
                 scene->loop.threads, scene->loop.threads - 1);
    --scene->loop.threads;
  }
  auto team = SpinningTeam::create(
      scene->loop.threads, [settings = scene->loop.realtime, fast = options.fast](int worker) {
        set_up_worker_thread(fast ? RealtimeSettings{.fifo = false} : settings, worker);
      });
  if (!team) return refuse(team.error());
  if (scene->loop.threads > 1) model->share_work(team->get());

  Pipeline::Parameters parameters{.fast = options.fast,
                                  .delay = delay,
                                  .duration = std::nullopt,
                                  .max_catch_up_ticks = scene->loop.max_catch_up_ticks,
                                  .wait = scene->loop.wait,
                                  .realtime = scene->loop.realtime,
                                  .team = team->get()};
  TerminalLine terminal;
  parameters.on_sink_failure = [&](const std::string& uri, const std::string& error_message) {
    terminal.say("merkel: the sink " + uri + " is closed, the run goes on: " + error_message);
  };
  parameters.on_notice = [&](const std::string& sentence) { terminal.say("merkel: " + sentence); };
  parameters.on_missing_right = [&](const std::string& sentence) {
    terminal.say("merkel: note: " + sentence);
  };
  ServiceNotice service;
  parameters.on_progress = [&, line = StatusLine()](const RunProgress& progress) mutable {
    service.progress(progress.counters);
    if (terminal.on_terminal()) terminal.show(line.fields(progress));
  };
  if (options.duration_s) parameters.duration = units::nanoseconds_from_s(*options.duration_s);
  Pipeline pipeline(*model, parameters);
  RunDescription description = describe_run(*scene, *model);
  for (const auto& probe : probes) add_probe_facts(probe->info(), description);
  if (!options.record.empty()) {
    description.facts.emplace_back(
        "command", "merkel run --probe '" + probes[0]->info().uri + "' --record " + options.record);
  }
  for (std::size_t i = 0; i < probes.size(); ++i) {
    pipeline.add_probe(std::move(probes[i]), scene->probes[i].input);
  }
  const auto recording = std::make_shared<RecordingSwitch>();
  const SinkSetup setup{.neurons = static_cast<std::uint32_t>(model->neurons()),
                        .overwrite = options.overwrite,
                        .allow_remote = options.allow_remote,
                        .run = std::move(description),
                        .notice = parameters.on_notice,
                        .recording = recording};
  bool summary_to_stderr = false;
  for (const std::string& uri : scene->sinks) {
    auto sink = open_sink(uri, setup);
    if (!sink) return refuse(sink.error());
    summary_to_stderr = summary_to_stderr || uri == "csv:-" || uri == "csv:/dev/stdout";
    const std::string address = (*sink)->address();
    if (!address.empty()) std::fprintf(stderr, "live page: %s\n", address.c_str());
    pipeline.add_sink(std::move(*sink));
  }
  if (recording->offered()) pipeline.add_sink(session_on_request(recording, setup));

  const StopSignal stop(pipeline);
  const CrashWatch watch(pipeline.statistics(), model->parameters().tick);
  const auto report = pipeline.run();
  terminal.clear();
  if (!report) return refuse(report.error());

  const std::string summary =
      options.json ? summary_json(*report, *model, plan ? &*plan : nullptr)
                   : summary_text(*report, *model, plan ? &*plan : nullptr, options.all);
  std::fputs(summary.c_str(), summary_to_stderr ? stderr : stdout);
  if (!report->error_message.empty()) {
    return refuse(report->error_message);
  }
  for (const RunReport::OfSink& sink : report->sinks) {
    if (!sink.error_message.empty()) return fail(sink.error_message);
  }
  return failed(verdict_of(*report, *model), options.strict) ? kFailed : kDone;
}

}  // namespace

void add_run_command(CommandLine& program) {
  auto options = std::make_shared<RunOptions>();
  program
      .subcommand("run",
                  "Runs a scene: reads its probes, simulates the afferents, sends their spikes to "
                  "the sinks and prints a summary. Without a scene: the paper's fingertip (a "
                  "sphere of 2 mm radius at its centre). Without a probe: a 1.5 mm ramp-and-hold.",
                  "run --fast --probe replay:tests/traces/taps.csv --sink csv:spikes.csv")
      .option("scene", options->scene,
              "Scene file (TOML), or a preset: paper, paper-wide, goodwin, goodwin-cs, hand")
      .list("--probe", options->probes,
            "Probe URI, once for each of the scene's probes: replay:FILE, sim:SHAPE, "
            "serial:DEVICE?protocol=NAME, hid:VID:PID, usb:VID:PID, udp:HOST:PORT?protocol=NAME, "
            "tcp:HOST:PORT?protocol=NAME, fused:URI|URI")
      .list("--sink", options->sinks, "Sink URI, repeatable: " + sink_schemes())
      .option(
          "--record", options->record,
          "Trace (.csv) or session (.xdf) to write the probe's samples to: replayed, it gives the "
          "same spikes. The same as --sink trace:FILE or xdf:FILE")
      .flag("--fast", options->fast,
            "Virtual clock: as fast as possible, with the same spikes (recordings only)")
      .option("--duration-s", options->duration_s, "Stop after so many seconds of probe time",
              {1e-6, 1e9})
      .option("--seed", options->seed,
              "Seed of the receptors, the network's weights and the neurons' noise")
      .flag("--json", options->json, "Print the summary as JSON")
      .flag("--all", options->all,
            "Print every afferent at the end, not only the ten with the highest rates")
      .flag(
          "--strict", options->strict,
          "Exit 1 where samples, ticks or spikes were lost, more than 1 % of ticks held, or ticks "
          "ended late")
      .flag("--overwrite", options->overwrite, "Replace files that exist")
      .flag("--allow-remote", options->allow_remote,
            "Let sinks send to, or be reached from, other machines")
      .notes(kSimProbeHelp)
      .runs([options] { return run(*options); });
}

}  // namespace merkel
