#include <atomic>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/records/taxel_blocks.hpp"
#include "core/units.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "drivers/uri.hpp"
#include "realtime/input/frame_tap.hpp"
#include "tools/commands/command.hpp"
#include "tools/filled_text.hpp"
#include "tools/json_text.hpp"
#include "tools/print_text.hpp"
#include "tools/run/device_summary.hpp"
#include "tools/run/stop_signal.hpp"
#include "tools/run/terminal_line.hpp"
#include "tools/scene/machine_facts.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {
namespace {

struct RecordOptions {
  std::string uri;
  std::string file;
  std::optional<double> duration_s;
  bool frames = false;
  bool overwrite = false;
  bool allow_remote = false;
  bool json = false;
};

/// So long after its end a recording waits for the last samples of a device.
constexpr std::chrono::milliseconds kFarewell{500};

std::chrono::nanoseconds host_now() { return std::chrono::steady_clock::now().time_since_epoch(); }

/// The sink for the samples (a trace, or a session without a simulation) and the taps for the
/// device's bytes.
class Recording {
 public:
  static Expected<Recording, SetupError> create(const RecordOptions& options, Probe& probe,
                                                const std::string& command) {
    Recording recording;
    RunDescription run;
    run.facts = {{"command", command}, {"version", MERKEL_VERSION}, {"git_hash", kGitHash}};
    add_probe_facts(probe.info(), run);
    for (auto& fact : machine_facts()) run.facts.push_back(std::move(fact));
    for (auto& fact : utc_facts()) run.facts.push_back(std::move(fact));
    const bool session = options.file.ends_with(".xdf");
    if (options.frames && !session) {
      return bad_input("--frames needs a session: give " + options.file + " the ending .xdf");
    }
    if (session && probe.info().taxels > 0) {
      return bad_input(
          "a session holds the pressures of a tactile array as a run used them: give " +
          options.file + " the ending .csv, or record a run (merkel run SCENE --sink xdf:FILE)");
    }
    auto sink = open_sink(
        (session ? "xdf:" : "trace:") + options.file + (options.frames ? "?frames=1" : ""),
        {.neurons = 0,
         .overwrite = options.overwrite,
         .allow_remote = false,
         .run = std::move(run),
         .notice = warn});
    if (!sink) return Unexpected<SetupError>(sink.error());
    recording.sink_ = std::move(*sink);
    recording.replayed_ = probe.info().replayed;
    if (probe.info().taxels > 0) recording.taxels_.emplace(probe.info().taxels);
    recording.pressures_.resize(probe.info().taxels);
    if (!recording.sink_->takes<PortFrame>()) return recording;
    for (std::uint32_t port = 0; port < probe.ports(); ++port) {
      auto& feed =
          *recording.feeds_.emplace_back(std::make_unique<Feed<PortFrame>>(FrameTap::kCapacity));
      recording.taps_.push_back(std::make_unique<FrameTap>(probe, 0, port, feed));
    }
    return recording;
  }
  /// Writes the readings, and everything that has waited for longer than 100 ms. \return the error,
  /// or an empty string
  std::string write(const Readings& readings) {
    if (readings.empty() && !started_) return {};
    if (!started_) {
      started_ = true;
      const ClockPair clocks = read_clock_pair();
      const auto first = readings.head(0).time;
      const auto zero = replayed_ ? std::chrono::nanoseconds{0} : first;
      const auto zero_on_host = replayed_ ? clocks.monotonic - first : first;
      keep(sink_->begin({.start = zero, .utc = clocks.utc - (clocks.monotonic - zero_on_host)}));
    }
    write_all(&readings, {});
    const auto now = std::chrono::steady_clock::now();
    if (now >= next_flush_) {
      keep(sink_->flush());
      next_flush_ = now + std::chrono::milliseconds{100};
    }
    return error_;
  }
  std::string close() {
    for (const auto& tap : taps_) tap->end();
    const RunStatus status{.counters = {}, .losses = {.frames = lost_frames()}, .rights = {}};
    write_all(nullptr, {&status, 1});
    if (error_.empty()) keep(sink_->close());
    return error_;
  }
  /// The file that is written: with the time for %t.
  [[nodiscard]] std::string file() const { return Uri::parse(sink_->uri())->path; }
  /// Frames of device bytes that were dropped because nothing was written for too long.
  [[nodiscard]] std::uint64_t lost_frames() const {
    std::uint64_t lost = 0;
    for (const auto& feed : feeds_) lost += feed->dropped();
    return lost;
  }

 private:
  void keep(const Expected<void, SinkError>& result) {
    if (!result && error_.empty()) error_ = result.error().sentence;
  }
  /// Writes the waiting frames of the ports with these readings.
  void write_all(const Readings* readings, std::span<const RunStatus> status) {
    clear_all(records_);
    if (readings != nullptr) records_.edges = readings->edges();
    for (const auto& feed : feeds_) feed->take(records_.frames);
    for (std::size_t i = 0; readings != nullptr && i < readings->size(); ++i) {
      const auto sample = readings->sample(i);
      if (!sample) continue;
      const auto further = readings->further(i);
      records_.samples.push_back({.sample = *sample, .further = {further.begin(), further.end()}});
      ++taken_;
      if (!taxels_) continue;
      const auto row = readings->taxels(i);
      std::ranges::transform(row, pressures_.begin(),
                             [](double kPa) { return static_cast<float>(kPa); });
      // Without ticks, a block belongs to the sample of its number.
      const auto blocks = taxels_->changed(pressures_, sample->time, taken_, 0);
      records_.taxels.insert(records_.taxels.end(), blocks.begin(), blocks.end());
    }
    RecordBatch batch = batch_of(records_);
    batch.status = status;
    keep(sink_->write(batch));
  }

  std::unique_ptr<Sink> sink_;
  Feeds<PortFrame> feeds_;
  std::vector<std::unique_ptr<FrameTap>> taps_;
  RecordLists<RecordVector> records_;
  std::optional<ChangedTaxels<TaxelBlock>> taxels_;
  std::vector<float> pressures_;  ///< of the last sample
  std::uint64_t taken_ = 0;       ///< samples
  bool replayed_ = false;
  bool started_ = false;
  std::chrono::steady_clock::time_point next_flush_{};
  std::string error_;
};

int record(const RecordOptions& options) {
  auto probe = open_probe(options.uri, options.allow_remote);
  if (!probe) return refuse(probe.error());
  std::string command = "merkel record '" + options.uri + "' " + options.file;
  if (options.duration_s) command += " --duration-s " + shortest_decimal(*options.duration_s);
  std::atomic<bool> stop{false};
  const StopSignal stop_signal(stop);
  auto recording = Recording::create(options, **probe, command);
  if (!recording) return refuse(recording.error());

  Readings readings = (*probe)->readings();
  std::optional<std::chrono::nanoseconds> end;
  std::uint64_t written = 0;
  TerminalLine terminal;
  ReadingBar bar;
  auto show_again = std::chrono::steady_clock::now();
  const std::chrono::nanoseconds opened = host_now();
  const bool device = !(*probe)->info().replayed;
  std::optional<ProbeError> broken;
  while (!stop.load()) {
    const auto count = (*probe)->read(readings, std::chrono::milliseconds{100});
    terminal.print_notices((*probe)->take_notices());
    if (!count) {
      if (count.error() != ProbeError::kEndOfStream) broken = count.error();
      break;
    }
    std::size_t wanted = *count;
    if (options.duration_s && *count > 0) {
      if (!end) end = readings.head(0).time + units::nanoseconds_from_s(*options.duration_s);
      while (wanted > 0 && readings.head(wanted - 1).time > *end) --wanted;
    }
    // A device that has gone sends no sample after the end.
    if (options.duration_s && *count == 0 && device &&
        host_now() >
            end.value_or(opened + units::nanoseconds_from_s(*options.duration_s)) + kFarewell) {
      break;
    }
    readings.resize(wanted);
    const std::string error = recording->write(readings);
    if (!error.empty()) return fail(error);
    written += wanted;
    if (wanted > 0 && std::chrono::steady_clock::now() >= show_again) {
      show_again += std::chrono::milliseconds{200};
      const ProbeSample last = readings.sample(wanted - 1).value_or(ProbeSample{});
      LiveReading reading;
      if (last.has(ProbeSample::kForce)) reading.force_N = units::N_from_mN(last.force_mN);
      if (last.has(ProbeSample::kDepth)) reading.depth_mm = last.depth_mm;
      terminal.show({bar.text(reading), std::to_string(written) + " samples"});
    }
    if (wanted < *count) break;
  }
  terminal.clear();
  if (const std::string error = recording->close(); !error.empty()) return fail(error);
  if (recording->lost_frames() > 0) {
    print_text(stderr, "merkel: at least {} frames of device bytes were not recorded\n",
               recording->lost_frames());
  }
  const auto counts = (*probe)->device_counts();
  if (options.json) {
    const Json summary = {
        {"file", recording->file()}, {"samples", written}, {"device", device_json(counts)}};
    std::fputs(json_text(summary).c_str(), stdout);
  } else {
    if (counts) std::fputs(filled_text("device", device_json(counts)).c_str(), stderr);
    print_text(stderr, "{} samples written to {}\n", written, recording->file());
  }
  if (broken) {
    const std::string message = (*probe)->error_message();
    return *broken == ProbeError::kBadData ? refuse(message) : fail(message);
  }
  if (device && written == 0 && !stop.load()) {
    return fail("the probe " + options.uri + " sent no sample: check that it is streaming");
  }
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
      .option("--duration-s", options->duration_s, "Stop after this time, s", {1e-6, 1e9})
      .flag("--frames", options->frames, "Keep the bytes of the devices too, in a session")
      .flag("--overwrite", options->overwrite, "Replace an existing file")
      .flag("--allow-remote", options->allow_remote, kRemoteProbesHelp)
      .flag("--json", options->json, "Print a summary with the device's counters as JSON")
      .runs([options] { return record(*options); });
}

}  // namespace merkel
