#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "core/parameters/nearest_name.hpp"
#include "core/units.hpp"
#include "drivers/files/dated_name.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/sessions/session_copy.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "drivers/spike_files/pulse_file.hpp"
#include "drivers/uri.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/export_run.hpp"
#include "tools/filled_text.hpp"
#include "tools/json_text.hpp"
#include "tools/number_text.hpp"
#include "tools/print_text.hpp"
#include "tools/run/session_alignment.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr CommandLine::Range kLines{1, 65535};

struct AlignOptions {
  std::string session;
  std::string to;
  std::string mark;
  std::optional<std::uint32_t> line;
  std::optional<std::uint32_t> to_line;
  std::optional<double> jitter_ms;
  std::vector<std::string> sinks;
  std::string time_zero = "device";
  bool overwrite = false;
  bool json = false;
};

/// The pulses of the wanted line of the other recorder, or of its only one.
Expected<std::vector<nanoseconds>, SetupError> pulses_of(const AlignOptions& options) {
  auto file = read_pulse_file(options.to);
  if (!file) return Unexpected<SetupError>(file.error());
  const std::uint32_t wanted = options.to_line.value_or(0);
  if (file->lines.contains(wanted)) return std::move(file->lines.at(wanted));
  if (!options.to_line && file->lines.size() == 1) return std::move(file->lines.begin()->second);
  const std::string known = listed(file->lines, [](const auto& line) {
    return fmt::format("{} ({} pulses)", line.first, line.second.size());
  });
  if (known.empty()) return bad_input(options.to + " has no pulses of a sync line");
  return bad_input(options.to + " has the lines " + known + ": choose one with --to-line");
}

/// Prints how the session was aligned, and notes it in what is written.
void print_alignment(const AlignOptions& options, const Json& aligned, RunDescription& run) {
  const double offset_s = aligned["offset_s"].get<double>();
  const double rate_ppm = aligned["rate_ppm"].get<double>();
  const std::string residual_ms = number_text(aligned["residual_ms"].get<double>());
  run.facts.emplace_back("aligned_to", options.to);
  run.facts.emplace_back("aligned_offset_ns",
                         std::to_string(units::nanoseconds_from_s(offset_s).count()));
  run.facts.emplace_back("aligned_rate_ppm", fmt::format("{:.6f}", rate_ppm));
  run.facts.emplace_back("aligned_residual_ms", residual_ms);
  if (options.json) {
    std::fputs(json_text(aligned).c_str(), stdout);
    return;
  }
  Json facts = aligned;
  facts["session"] = options.session;
  std::fputs(filled_text("alignment", facts).c_str(), stderr);
}

/// Matches the pulses of a session with those of the other recorder.
Expected<Json, SetupError> match_session(const AlignOptions& options,
                                         const RecordedSession& session, ClockMap& clock) {
  const auto pulses = pulses_of(options);
  if (!pulses) return Unexpected<SetupError>(pulses.error());
  const auto own = SessionClock::read(session, nullptr);
  if (!own) return Unexpected<SetupError>(own.error());
  PulseChoice choice{.mark = options.mark, .line = options.line};
  if (options.jitter_ms) choice.tolerance = units::nanoseconds_from_s(1e-3 * *options.jitter_ms);
  const auto aligned = align_pulses(*own, choice, *pulses, options.to);
  if (!aligned) return Unexpected<SetupError>(aligned.error());
  clock = aligned->fit.map;
  return alignment_json(*aligned, *own, options.to);
}

/// The only alignment that a session records.
Expected<RecordedAlignment, SetupError> only_alignment(const RecordedSession& session) {
  auto all = recorded_alignments(session.run().facts);
  if (all.size() == 1) return std::move(all.front());
  return bad_input(session.path() +
                   (all.empty() ? " records no alignment"
                                : " records alignments to " + listed(all, &RecordedAlignment::to)) +
                   ": name the pulses on the other clock with --to");
}

/// Copies a session with its alignment, which replaces an earlier one to the same file. Its streams
/// stay on the clock of its run, whose ticks are equal, so that it can be replayed.
Expected<void, SetupError> record_alignment(const AlignOptions& options, const std::string& sink,
                                            const Json& aligned) {
  const auto uri = Uri::parse(sink);
  if (!uri) return Unexpected<SetupError>(uri.error());
  if (auto done = UriOptions(*uri).finish(); !done) return done;
  auto copy = OutputFile::create(dated_name(uri->path, std::chrono::system_clock::now()),
                                 options.overwrite, warn);
  if (!copy) return Unexpected<SetupError>(copy.error());
  return copy_session(options.session, std::move(*copy), kAlignmentFact,
                      aligned.dump(-1, ' ', false, Json::error_handler_t::replace),
                      [&](std::string_view value) {
                        const auto earlier = parse_alignment(value);
                        return !earlier || earlier->to == options.to;
                      });
}

/// Prints the alignment that the session records. \param start  of the session, on its clock
void print_recorded(const AlignOptions& options, const RecordedAlignment& recorded,
                    const ClockMap& clock, nanoseconds start) {
  if (options.json) {
    std::fputs(json_text(recorded.json).c_str(), stdout);
    return;
  }
  print_text(stderr, "{}: the recorded alignment to {}: {:+.9f} s, {:+.3f} ppm\n", options.session,
             recorded.to, units::s_from(clock(start) - start), clock.rate() * 1e6);
}

/// An option that chooses what is matched with the pulses of --to; empty if none is given.
std::string matching_option(const AlignOptions& options) {
  if (!options.mark.empty()) return "--mark";
  if (options.line) return "--line";
  if (options.to_line) return "--to-line";
  return options.jitter_ms ? "--jitter-ms" : "";
}

int align_session(const AlignOptions& options) {
  const auto zero = time_zero_named(options.time_zero);
  if (!zero) return refuse(zero.error());
  if (options.line && !options.mark.empty()) {
    return refuse("--mark and --line exclude each other: remove one");
  }
  if (const auto option = matching_option(options); options.to.empty() && !option.empty()) {
    return refuse(option +
                  " is about the pulses on the other clock: name them with --to, or leave " +
                  option + " out to use the alignment that the session records");
  }
  auto opened = RecordedSession::open(options.session);
  if (!opened) return refuse(opened.error());
  const std::shared_ptr<RecordedSession> session = std::move(*opened);
  RunDescription run = session->run();
  std::vector<std::string> sinks;
  std::vector<std::string> copies;
  for (const std::string& uri : options.sinks) {
    (uri.starts_with("xdf:") ? copies : sinks).push_back(uri);
  }
  if (!copies.empty() && (options.to.empty() || !split_rig(options.session).second.empty())) {
    return refuse(
        "xdf: copies a session and records its alignment: use it with --to PULSES, and not for a "
        "rig in a recording of LabRecorder");
  }
  ClockMap clock;
  std::string to = options.to;
  if (to.empty()) {
    const auto recorded = only_alignment(*session);
    if (!recorded) return refuse(recorded.error());
    clock = ClockMap(recorded->points);
    to = recorded->to;
    run.facts.emplace_back("aligned_to", to);
    print_recorded(options, *recorded, clock, session->origin().start);
  } else {
    const auto aligned = match_session(options, *session, clock);
    if (!aligned) return refuse(aligned.error());
    for (const std::string& sink : copies) {
      if (auto done = record_alignment(options, sink, *aligned); !done) return refuse(done.error());
    }
    print_alignment(options, *aligned, run);
  }
  if (sinks.empty()) return kDone;
  session->set_clock(clock);
  std::uint64_t spikes = 0;
  const int exit_code = export_run(session, session->origin(), sinks,
                                   {.neurons = session->neurons(),
                                    .overwrite = options.overwrite,
                                    .run = std::move(run),
                                    .time_zero = *zero},
                                   spikes);
  if (exit_code != kDone) return exit_code;
  print_text(stderr, "{} spikes on the clock of {}{}\n", spikes, to,
             session->complete() ? "" : "; the recording is incomplete and ends there");
  return kDone;
}

}  // namespace

void add_align_command(CommandLine& program) {
  auto options = std::make_shared<AlignOptions>();
  program
      .subcommand("align",
                  "Puts a session on the clock of another recorder, by the pulses of a sync line "
                  "that both saw, and writes it to any of the file sinks. xdf: copies the session "
                  "and records the alignment in it, for inspect, Python and a later align "
                  "without --to.",
                  "align session.xdf --to events/TTL --sink nwb:aligned.nwb")
      .option("session", options->session, kSessionHelp)
      .required()
      .option(
          "--to", options->to,
          "The pulses on the other clock: a file with a time in s per row (SpikeGLX's edge "
          "files, any CSV), Open Ephys' folder of a TTL line or a .npy file in it, or a session; "
          "none: the alignment that the session records")
      .option("--mark", options->mark,
              "Match the session's marks with this label instead of its sync line")
      .option("--line", options->line, "Sync line of the session", kLines)
      .option("--to-line", options->to_line, "Line of the other recorder", kLines)
      .option("--jitter-ms", options->jitter_ms,
              "How far the time of a pulse may be off, ms: twice the sample period of the line; "
              "default: 2",
              {1e-3, 1000.0})
      .list("--sink", options->sinks,
            "Sink URI, repeatable: " + sink_schemes() + "; none: only print the alignment")
      .option("--time-zero", options->time_zero,
              "Zero of the times in files: device (that of the other clock), session (the start of "
              "the session) or unix (1970-01-01)")
      .flag("--overwrite", options->overwrite, "Replace existing files")
      .flag("--json", options->json, "Print the alignment as JSON")
      .runs([options] { return align_session(*options); });
}

}  // namespace merkel
