#include <atomic>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/files/trace_file.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "realtime/input/frame_tap.hpp"
#include "tools/commands/command.hpp"
#include "tools/run/device_summary.hpp"
#include "tools/run/machine_facts.hpp"
#include "tools/run/terminal_line.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {
namespace {

struct RecordOptions {
  std::string uri;
  std::string file;
  std::optional<double> duration_s;
  bool overwrite = false;
  bool json = false;
};

std::atomic<bool> g_stop{false};

void stop_recording(int /*signal*/) { g_stop.store(true); }

/// Where the samples go: a trace, or a session without a simulation.
class Recording {
 public:
  static Expected<Recording, SetupError> create(const RecordOptions& options, Probe& probe,
                                                const std::string& command) {
    Recording recording;
    if (options.file.ends_with(".xdf")) {
      RunDescription run;
      run.facts = {{"command", command}, {"version", MERKEL_VERSION}, {"git_hash", kGitHash}};
      add_probe_facts(probe.info(), run);
      for (auto& fact : machine_facts()) run.facts.push_back(std::move(fact));
      auto sink = open_sink(
          "xdf:" + options.file,
          SinkSetup{.overwrite = options.overwrite, .allow_remote = false, .run = std::move(run)});
      if (!sink) return Unexpected<SetupError>(sink.error());
      recording.session_ = std::move(*sink);
      for (std::size_t port = 0; port < probe.ports(); ++port) {
        recording.taps_.push_back(std::make_unique<FrameTap>(probe, 0, port));
      }
      return recording;
    }
    auto trace =
        TraceWriter::create(options.file, probe.info().channels, {&command, 1}, options.overwrite);
    if (!trace) return Unexpected<SetupError>(trace.error());
    recording.trace_.emplace(std::move(*trace));
    return recording;
  }
  /// Both return what went wrong; nothing, if nothing did.
  std::string write(std::span<const ProbeSample> samples) {
    if (trace_) return sentence_of(trace_->write(samples));
    std::string trouble = write_frames();
    if (trouble.empty()) trouble = sentence_of(session_->write_samples(0, samples));
    return trouble.empty() ? sentence_of(session_->flush()) : trouble;
  }
  std::string close() {
    if (trace_) return sentence_of(trace_->close());
    for (const auto& tap : taps_) tap->end();
    const std::string trouble = write_frames();
    return trouble.empty() ? sentence_of(closed_session()) : trouble;
  }
  /// Bytes of the devices that found no room, because nothing was written for too long.
  [[nodiscard]] std::uint64_t lost_frames() const {
    std::uint64_t lost = 0;
    for (const auto& tap : taps_) lost += tap->queue.dropped.value();
    return lost;
  }

 private:
  template <class Error>
  static std::string sentence_of(const Expected<void, Error>& result) {
    return result ? std::string() : result.error().sentence;
  }
  std::string write_frames() {
    for (const auto& tap : taps_) {
      std::vector<RawFrame> frames;
      for (RawFrame frame; tap->queue.items.try_pop(frame);) frames.push_back(frame);
      if (frames.empty()) continue;
      std::string trouble = sentence_of(session_->write_frames(tap->probe(), tap->port(), frames));
      if (!trouble.empty()) return trouble;
    }
    return {};
  }
  Expected<void, SetupError> closed_session() {
    if (auto told = session_->write_status(
            {.counters = {}, .losses = {.frames = lost_frames()}, .rights = {}});
        !told) {
      return unavailable(told.error().sentence);
    }
    if (auto closed = session_->close(); !closed) return unavailable(closed.error().sentence);
    return {};
  }

  std::optional<TraceWriter> trace_;
  std::unique_ptr<SpikeSink> session_;
  std::vector<std::unique_ptr<FrameTap>> taps_;
};

int record(const RecordOptions& options) {
  auto probe = open_probe(options.uri);
  if (!probe) return refuse(probe.error());
  std::string command = "merkel record '" + options.uri + "' " + options.file;
  if (options.duration_s) command += " --duration-s " + shortest_decimal(*options.duration_s);
  auto recording = Recording::create(options, **probe, command);
  if (!recording) return refuse(recording.error());

  std::signal(SIGINT, stop_recording);
  std::signal(SIGTERM, stop_recording);
  std::vector<ProbeSample> samples(1024);
  std::optional<std::chrono::nanoseconds> end;
  std::uint64_t written = 0;
  TerminalLine terminal;
  ReadingBar bar;
  auto show_again = std::chrono::steady_clock::now();
  while (!g_stop.load()) {
    const auto count = (*probe)->read(samples, std::chrono::milliseconds{100});
    for (const std::string& sentence : (*probe)->take_notices()) {
      terminal.say("merkel: " + sentence);
    }
    if (!count) {
      if (count.error() == ProbeError::kEndOfStream) break;
      return fail((*probe)->trouble());
    }
    std::size_t wanted = *count;
    if (options.duration_s && *count > 0) {
      if (!end) end = samples[0].time + units::nanoseconds_from_s(*options.duration_s);
      while (wanted > 0 && samples[wanted - 1].time > *end) --wanted;
    }
    if (wanted > 0) {
      const std::string trouble = recording->write(std::span(samples).first(wanted));
      if (!trouble.empty()) return fail(trouble);
    }
    written += wanted;
    if (wanted > 0 && std::chrono::steady_clock::now() >= show_again) {
      show_again += std::chrono::milliseconds{200};
      const ProbeSample& last = samples[wanted - 1];
      LiveReading reading;
      if (last.has(ProbeSample::kForce)) reading.force_N = units::N_from_mN(last.force_mN);
      if (last.has(ProbeSample::kDepth)) reading.depth_mm = last.depth_mm;
      terminal.show({bar.text(reading), std::to_string(written) + " samples"});
    }
    if (wanted < *count) break;
  }
  terminal.clear();
  if (const std::string trouble = recording->close(); !trouble.empty()) return fail(trouble);
  if (recording->lost_frames() > 0) {
    std::fprintf(stderr, "merkel: at least %llu portions of the device's bytes are not in it\n",
                 static_cast<unsigned long long>(recording->lost_frames()));
  }
  const auto device = (*probe)->device_counts();
  if (options.json) {
    const nlohmann::ordered_json summary = {
        {"file", options.file}, {"samples", written}, {"device", device_json(device)}};
    std::printf("%s\n", summary.dump(2).c_str());
    return kDone;
  }
  if (device) std::fputs(device_text(*device).c_str(), stderr);
  std::fprintf(stderr, "%llu samples written to %s\n", static_cast<unsigned long long>(written),
               options.file.c_str());
  return kDone;
}

}  // namespace

void add_record_command(CommandLine& program) {
  auto options = std::make_shared<RecordOptions>();
  program
      .subcommand("record",
                  "Writes a probe's samples to a trace (CSV) or, if the file ends in .xdf, "
                  "to a session without a simulation.",
                  "record 'sim:taps?depth_mm=1' taps.csv")
      .option("uri", options->uri, "Probe URI")
      .required()
      .option("file", options->file, "File to write: a trace (.csv) or a session (.xdf)")
      .required()
      .option("--duration-s", options->duration_s, "Stop after so many seconds", {1e-6, 1e9})
      .flag("--overwrite", options->overwrite, "Replace a file that exists")
      .flag("--json", options->json,
            "Print what was recorded, and what the device counted, as JSON")
      .runs([options] { return record(*options); });
}

}  // namespace merkel
