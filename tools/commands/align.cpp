#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "core/units.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "drivers/spike_files/pulse_file.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/export_run.hpp"
#include "tools/json_text.hpp"
#include "tools/number_text.hpp"
#include "tools/run/session_alignment.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

struct AlignOptions {
  std::string session;
  std::string to;
  std::string mark;
  std::optional<std::uint64_t> line;
  std::optional<std::uint64_t> to_line;
  double jitter_ms = 2.0;
  std::vector<std::string> sinks;
  std::string time_zero = "device";
  bool overwrite = false;
  bool json = false;
};

/// The pulses of the wanted line of the other recorder, or of its only one.
Expected<std::vector<nanoseconds>, SetupError> pulses_of(const AlignOptions& options) {
  auto file = read_pulse_file(options.to);
  if (!file) return Unexpected<SetupError>(file.error());
  const auto wanted = static_cast<std::uint32_t>(options.to_line.value_or(0));
  if (file->lines.contains(wanted)) return std::move(file->lines.at(wanted));
  if (!options.to_line && file->lines.size() == 1) return std::move(file->lines.begin()->second);
  std::string known;
  for (const auto& [line, times] : file->lines) {
    known += fmt::format("{}{} ({} pulses)", known.empty() ? "" : ", ", line, times.size());
  }
  if (known.empty()) return bad_input(options.to + " has no pulses of a sync line");
  return bad_input(options.to + " has the lines " + known + ": choose one with --to-line");
}

double rms_ms(const std::vector<nanoseconds>& residuals) {
  double sum = 0.0;
  for (const nanoseconds each : residuals) sum += std::pow(units::ms_from(each), 2);
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(residuals.size(), 1)));
}

/// Prints how the session was aligned, and notes it in what is written.
void print_alignment(const AlignOptions& options, const PulseAlignment& aligned,
                     const RecordedSession& own, RunDescription& run) {
  const nanoseconds start = own.origin().start;
  const nanoseconds offset = aligned.fit.map(start) - start;
  const double rate_ppm = aligned.fit.map.rate() * 1e6;
  const double residual_ms = units::ms_from(aligned.fit.residual.value_or(nanoseconds{0}));
  const double jitter_ms = rms_ms(aligned.match.residuals);
  run.facts.emplace_back("aligned_to", options.to);
  run.facts.emplace_back("aligned_offset_ns", std::to_string(offset.count()));
  run.facts.emplace_back("aligned_rate_ppm", fmt::format("{:.6f}", rate_ppm));
  run.facts.emplace_back("aligned_residual_ms", number_text(residual_ms));
  if (options.json) {
    const Json summary = {{"matched", aligned.match.pairs.size()},
                          {"pulses", aligned.match.total},
                          {"pulses_to", aligned.match.total_other},
                          {"inverted", aligned.falling},
                          {"offset_s", units::s_from(offset)},
                          {"rate_ppm", rate_ppm},
                          {"pieces", aligned.fit.map.pieces()},
                          {"residual_ms", residual_ms},
                          {"jitter_rms_ms", jitter_ms}};
    std::fputs(json_text(summary).c_str(), stdout);
    return;
  }
  const std::size_t pieces = aligned.fit.map.pieces();
  std::fputs(
      fmt::format(
          "{}: {} of {} pulses match ({} in {}){}\n{:+.9f} s, {:+.3f} ppm{}, residual {} ms, "
          "jitter of the pulses {} ms rms\n",
          options.session, aligned.match.pairs.size(), aligned.match.total,
          aligned.match.total_other, options.to,
          aligned.falling ? ", by the falling edges: the line is inverted" : "",
          units::s_from(offset), rate_ppm, pieces > 1 ? fmt::format(" in {} pieces", pieces) : "",
          number_text(residual_ms), number_text(jitter_ms))
          .c_str(),
      stderr);
}

int align_session(const AlignOptions& options) {
  const auto zero = time_zero_named(options.time_zero);
  if (!zero) return refuse(zero.error());
  if (options.line && !options.mark.empty()) {
    return refuse("--mark and --line exclude each other: remove one");
  }
  for (const std::string& uri : options.sinks) {
    if (!uri.starts_with("xdf:")) continue;
    return refuse(
        "a session stays on the clock of its run, whose ticks are equal, so that it can be "
        "replayed: use another sink, such as nwb:FILE");
  }
  auto opened = RecordedSession::open(options.session);
  if (!opened) return refuse(opened.error());
  const std::shared_ptr<RecordedSession> session = std::move(*opened);
  const auto pulses = pulses_of(options);
  if (!pulses) return refuse(pulses.error());
  const auto own = SessionClock::read(*session, nullptr);
  if (!own) return refuse(own.error());
  const auto aligned =
      align_pulses(*own,
                   {.mark = options.mark,
                    .line = options.line ? std::optional(static_cast<std::uint32_t>(*options.line))
                                         : std::nullopt,
                    .tolerance = units::nanoseconds_from_s(1e-3 * options.jitter_ms)},
                   *pulses, options.to);
  if (!aligned) return refuse(aligned.error());
  RunDescription run = session->run();
  print_alignment(options, *aligned, *session, run);
  if (options.sinks.empty()) return kDone;
  session->set_clock(aligned->fit.map);
  std::uint64_t spikes = 0;
  const int exit_code = export_run(session, session->origin(), options.sinks,
                                   {.neurons = session->neurons(),
                                    .overwrite = options.overwrite,
                                    .run = std::move(run),
                                    .time_zero = *zero},
                                   spikes);
  if (exit_code != kDone) return exit_code;
  std::fprintf(stderr, "%llu spikes on the clock of %s%s\n",
               static_cast<unsigned long long>(spikes), options.to.c_str(),
               session->complete() ? "" : "; the recording is incomplete and ends there");
  return kDone;
}

}  // namespace

void add_align_command(CommandLine& program) {
  auto options = std::make_shared<AlignOptions>();
  program
      .subcommand("align",
                  "Puts a session on the clock of another recorder, by the pulses of a sync line "
                  "that both saw, and writes it to any of the file sinks.",
                  "align session.xdf --to events/TTL --sink nwb:aligned.nwb")
      .option(
          "session", options->session,
          "Session, as recorded by --sink xdf:FILE; FILE@RIG for a rig in a file of LabRecorder")
      .required()
      .option(
          "--to", options->to,
          "The pulses on the other clock: a file with a time in s per row (SpikeGLX's edge "
          "files, any CSV), Open Ephys' folder of a TTL line or a .npy file in it, or a session")
      .required()
      .option("--mark", options->mark,
              "Match the session's marks with this label instead of its sync line")
      .option("--line", options->line, "Sync line of the session, from 1")
      .option("--to-line", options->to_line, "Line of the other recorder")
      .option("--jitter-ms", options->jitter_ms,
              "How far the time of a pulse may be off, ms: twice the sample period of the line",
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
