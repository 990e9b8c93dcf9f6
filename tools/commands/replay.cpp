#include <algorithm>
#include <atomic>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "drivers/sinks/session_position.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/run.hpp"
#include "tools/filled_text.hpp"
#include "tools/json_text.hpp"
#include "tools/run/session_playback.hpp"
#include "tools/run/session_replay.hpp"
#include "tools/run/stimulation_control.hpp"
#include "tools/run/stop_signal.hpp"
#include "tools/scene/machine_facts.hpp"
#include "tools/scene/scene_encoder.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {
namespace {

struct ReplayOptions {
  std::string session;
  std::vector<std::string> sinks;
  bool json = false;
  bool overwrite = false;
  bool allow_remote = false;
  bool realtime = false;
  std::optional<double> from_s;
};

Json json_of(const SessionReader& session, const SessionReplay::Outcome& verdict) {
  return {{"bit_identical", verdict.identical()},
          {"difference", verdict.difference},
          {"complete", session.complete()},
          {"ticks", verdict.ticks},
          {"spikes", verdict.spikes},
          {"commands", verdict.commands},
          {"held_ticks", verdict.held_ticks},
          {"samples_late", verdict.samples_late},
          {"gaps", verdict.gaps},
          {"releases", verdict.releases},
          {"spikes_uncompared", verdict.uncompared},
          {"spikes_lost", verdict.losses.spikes},
          {"ticks_lost", verdict.losses.ticks},
          {"scene", session.fact("scene")},
          {"version", session.fact("version")},
          {"git_hash", session.fact("git_hash")},
          {"simd_target", session.fact("simd_target")},
          {"kernel", session.fact("kernel")}};
}

/// The verdict, with reservations if it does not cover the whole recording.
std::string text_of(const SessionReader& session, const SessionReplay::Outcome& verdict) {
  Json facts = json_of(session, verdict);
  facts["inputs_lost"] = verdict.losses.ticks + verdict.losses.taxels;
  if (session.fact("git_hash") != kGitHash) {
    facts["other_build"] = std::string(MERKEL_VERSION " (") + kGitHash + ")";
  }
  return filled_text("replay", facts);
}

/// Plays the recording to the sinks at its own speed, without simulating it.
int play(const ReplayOptions& options, const Scene& scene, const SessionNumbering& numbering,
         SinkSetup setup, const RunOrigin& origin) {
  const auto extent = SessionPlayback::measure(options.session, scene.model.tick);
  if (!extent) return refuse(extent.error());
  const auto position = std::make_shared<SessionPosition>();
  position->start = extent->start;
  position->length_s = units::s_from(extent->end - extent->start);
  if (options.from_s.value_or(0.0) > position->length_s) {
    return refuse("--from-s is beyond the end of the session, " +
                  shortest_decimal(position->length_s) + " s");
  }
  setup.session = position;
  std::atomic<bool> stopped{false};
  const StopSignal stop(stopped);
  const auto opened = open_separate_sinks(options.sinks, setup);
  if (!opened) return refuse(opened.error());
  const auto& sinks = *opened;
  bool page = false;
  for (const auto& sink : sinks) {
    const std::string address = sink->address();
    if (address.empty()) continue;
    page = true;
    std::fprintf(stderr, "live page: %s\n", address.c_str());
  }
  for (const auto& sink : sinks) {
    if (auto started = sink->begin(origin); !started) return fail(started.error().sentence);
  }
  std::fprintf(stderr, "playing %.1f s%s\n", position->length_s,
               page ? "; seek with the slider on the page, end with Ctrl-C" : "");
  std::optional<StimulationControl> control;
  if (!scene.encoding.electrodes.empty()) control.emplace(position->stimulation);
  SessionPlayback playback(options.session, *extent, numbering, scene, *position, sinks);
  const auto played = playback.play(
      extent->start + units::nanoseconds_from_s(options.from_s.value_or(0.0)), page, stopped);
  for (const auto& sink : sinks) {
    if (auto closed = sink->close(); !closed) return fail(closed.error().sentence);
  }
  return played ? kDone : fail(played.error().sentence);
}

/// Runs the press of a rig through its scene again: LabRecorder does not record ticks, from which
/// the same bits could be made.
int press_again(const ReplayOptions& options, SessionReader& session, Scene scene) {
  std::uint64_t spikes = 0;
  const auto read =
      session.for_each([&](const SessionChunk& chunk) { spikes += chunk.spikes.size(); });
  if (!read) return refuse(read.error());
  std::vector<std::string> probes;
  for (std::size_t i = 0; i < scene.probes.size(); ++i) {
    probes.push_back("replay:" + options.session + "?probe=" + std::to_string(i));
  }
  if (auto set = scene.set_probes(probes); !set) return refuse(set.error());
  scene.sinks = options.sinks;
  scene.spike_time_us.reset();  // the session has the method that was chosen by it
  warn(
      "note: a recording of LabRecorder has no inputs of ticks, so nothing is compared bit by bit: "
      "the press runs through its scene again; the rig itself sent " +
      std::to_string(spikes) + " spikes");
  return run_scene(std::move(scene), {.scene = split_rig(options.session).first,
                                      .fast = true,
                                      .json = options.json,
                                      .overwrite = options.overwrite,
                                      .allow_remote = options.allow_remote});
}

/// What is wrong with the options, or nothing.
std::string fault_of(const ReplayOptions& options) {
  if (options.from_s && !options.realtime) return "--from-s needs --realtime: add it";
  if (options.realtime && options.json) {
    return "--json prints the verdict of a simulation, but --realtime plays the recording "
           "without simulating: remove one of them";
  }
  if (options.realtime && options.sinks.empty()) {
    return "--realtime needs a sink: add one, such as --sink view:8080";
  }
  return "";
}

/// Sinks of a simulation, and the first error of one of them.
class ReplaySinks {
 public:
  explicit ReplaySinks(const std::vector<std::unique_ptr<Sink>>& sinks) : sinks_(sinks) {}

  void begin(const RunOrigin& origin) {
    for (const auto& sink : sinks_) keep(sink->begin(origin));
  }
  void write(const RecordBatch& batch) {
    for (const auto& sink : sinks_) keep(sink->write(batch));
  }
  void close() {
    for (const auto& sink : sinks_) keep(sink->close());
  }
  [[nodiscard]] const std::string& error_message() const { return error_message_; }

  [[nodiscard]] SessionReplay::Callbacks callbacks() {
    return {.spikes = [this](std::span<const SpikeEvent> spikes) { write({.spikes = spikes}); },
            .commands =
                [this](std::span<const StimulationCommand> commands) {
                  write({.commands = commands, .sent = unsent_of(commands)});
                },
            .ticks = [this](std::span<const TickRecord> ticks) { write({.ticks = ticks}); }};
  }

 private:
  void keep(const Expected<void, SinkError>& result) {
    if (!result && error_message_.empty()) error_message_ = result.error().sentence;
  }

  const std::vector<std::unique_ptr<Sink>>& sinks_;
  std::string error_message_;
};

int replay(const ReplayOptions& options) {
  if (const auto fault = fault_of(options); !fault.empty()) return refuse(fault);
  auto session = SessionReader::open(options.session);
  if (!session) return refuse(session.error());
  const auto scene = scene_of_session(*session);
  if (!scene) return refuse(scene.error());
  const std::string rig = session->fact("rig");
  if (!rig.empty() && options.realtime) {
    return refuse(
        "--realtime plays what the loop used, which LabRecorder does not record: make a session "
        "of the rig, merkel replay '" +
        options.session + "' --sink 'xdf:" + rig + ".xdf', and play that");
  }
  if (!rig.empty()) return press_again(options, *session, *scene);
  auto model = TactileModel::create(scene->model);
  if (!model) return refuse(scene->sentence(model.error()));

  const SessionNumbering numbering(*session, *model);
  auto encoder = encoder_of(*scene, *model);
  if (!encoder) return refuse(encoder.error());
  RunDescription run = describe_run(*scene, *model);
  for (const auto& fact : session->facts()) {
    if (fact.first.starts_with("probe")) run.facts.push_back(fact);
  }
  auto probes = probes_of_session(options.session);
  if (!probes) return refuse(probes.error());
  run.probes = std::move(*probes);
  const SinkSetup setup{.neurons = static_cast<std::uint32_t>(model->neurons()),
                        .overwrite = options.overwrite,
                        .allow_remote = options.allow_remote,
                        .run = std::move(run)};
  const auto origin = session_origin(*session);
  if (!origin) return refuse(origin.error());
  if (options.realtime) return play(options, *scene, numbering, setup, *origin);
  const auto opened = open_separate_sinks(options.sinks, setup);
  if (!opened) return refuse(opened.error());
  ReplaySinks sinks(*opened);
  sinks.begin(*origin);
  const SessionReplay::Callbacks made = sinks.callbacks();
  SessionReplay replay(*model, encoder->get());
  const auto read = session->for_each([&](SessionChunk& chunk) {
    numbering.apply(chunk);
    if (!chunk.taxels.empty()) sinks.write({.taxels = chunk.taxels});
    replay.take(chunk, made);
    return sinks.error_message().empty();
  });
  if (!read) return refuse(read.error());
  if (!sinks.error_message().empty()) return fail(sinks.error_message());
  const SessionReplay::Outcome verdict = replay.finish(made);
  sinks.close();
  if (!sinks.error_message().empty()) return fail(sinks.error_message());

  if (verdict.ticks == 0 && verdict.identical()) {
    return refuse(options.session +
                  " contains no tick inputs: it was recorded without a simulation, or ended "
                  "early");
  }
  const bool data_on_stdout =
      std::any_of(options.sinks.begin(), options.sinks.end(), writes_standard_output);
  std::fputs(
      (options.json ? json_text(json_of(*session, verdict)) : text_of(*session, verdict)).c_str(),
      data_on_stdout ? stderr : stdout);
  return verdict.identical() ? kDone : kFailed;
}

}  // namespace

void add_replay_command(CommandLine& program) {
  auto options = std::make_shared<ReplayOptions>();
  program
      .subcommand(
          "replay",
          "Simulates a recorded session again from the inputs of its loop, and reports "
          "whether the spikes are bit-identical: exit code 0 if they are, 1 if not. Reads "
          "incomplete sessions (FILE.xdf.part) up to their last complete tick. A rig in a file of "
          "LabRecorder has no such inputs: its press runs through its scene again, as by "
          "merkel run --fast.",
          "replay session.xdf")
      .option("session", options->session, kSessionHelp)
      .required()
      .list("--sink", options->sinks,
            "Also send the spikes to a sink, repeatable: " + sink_schemes())
      .flag("--realtime", options->realtime,
            "Play the recording to the sinks at its own speed, without simulating it")
      .option("--from-s", options->from_s, "With --realtime: start at this time of the session, s",
              {0.0, 1e9})
      .flag("--json", options->json, "Print the verdict as JSON")
      .flag("--overwrite", options->overwrite, "Replace existing files")
      .flag("--allow-remote", options->allow_remote, kRemoteSinksHelp)
      .runs([options] { return replay(*options); });
}

}  // namespace merkel
