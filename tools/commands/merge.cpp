#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "core/units.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/export_run.hpp"
#include "tools/number_text.hpp"
#include "tools/print_text.hpp"
#include "tools/run/merged_sessions.hpp"

namespace merkel {
namespace {

struct MergeOptions {
  std::vector<std::string> sessions;
  std::vector<std::string> sinks;
  std::string mark;
  bool pulses = false;
  double limit_ms = 10.0;
  bool accept_unknown = false;
  bool overwrite = false;
};

/// Prints how the sessions were aligned. Fails if they were not aligned well enough.
Expected<void, SetupError> check_alignment(const MergeOptions& options,
                                           const MergedSessions& merged) {
  for (const MergedSessions::Alignment& each : merged.alignments()) {
    const std::string offset = fmt::format("{:+.9f}", units::s_from(each.offset));
    if (!each.residual) {
      if (!options.accept_unknown) {
        return bad_input(
            "how well " + each.session + " is aligned (" + each.how + ") is unknown: " +
            (options.mark.empty()
                 ? "a host's clock was not synchronised, or the session is of an older version; "
                   "align by a mark that all sessions have, --by-mark LABEL, or accept it with "
                   "--accept-unknown"
                 : "use a mark that was set at least twice, or accept it with --accept-unknown"));
      }
      print_text(stderr, "{}: {} s by {}, residual unknown\n", each.session, offset, each.how);
      continue;
    }
    const double residual_ms = units::ms_from(*each.residual);
    if (residual_ms > options.limit_ms) {
      return bad_input(fmt::format(
          "{} is aligned ({}) only to within {} ms, and the limit is {} ms: {}, or accept it with "
          "--limit-ms",
          each.session, each.how, number_text(residual_ms), number_text(options.limit_ms),
          options.mark.empty() ? "align by a mark that all sessions have, --by-mark LABEL"
                               : "check that the marks are the same events"));
    }
    const std::string rate =
        each.rate == 0.0 ? "" : fmt::format(", rate {:+.3f} ppm", each.rate * 1e6);
    print_text(stderr, "{}: {} s by {}, residual {} ms{}\n", each.session, offset, each.how,
               number_text(residual_ms), rate);
  }
  return {};
}

int merge(const MergeOptions& options) {
  if (options.pulses && !options.mark.empty()) {
    return refuse("--by-pulses and --by-mark exclude each other: remove one");
  }
  if (options.sessions.size() < 2) return refuse("name at least two sessions to merge");
  for (const std::string& uri : options.sinks) {
    if (!uri.starts_with("xdf:")) continue;
    return refuse(
        "a session holds one scene, so merged sessions cannot be written as one: use another "
        "sink, such as nwb:FILE");
  }
  const auto opened = MergedSessions::open(
      options.sessions, {.mark = options.mark, .pulses = options.pulses, .progress = warn});
  if (!opened) return refuse(opened.error());
  const std::shared_ptr<MergedSessions>& merged = *opened;
  if (auto aligned = check_alignment(options, *merged); !aligned) return refuse(aligned.error());
  std::uint64_t spikes = 0;
  const int exit_code = export_run(
      merged, merged->origin(), options.sinks,
      {.neurons = merged->neurons(), .overwrite = options.overwrite, .run = merged->run()}, spikes);
  if (exit_code != kDone) return exit_code;
  print_text(stderr, "{} spikes of {} afferents of {} sessions merged{}\n", spikes,
             merged->neurons(), options.sessions.size(),
             merged->complete() ? "" : "; one recording is incomplete and ends earlier");
  return kDone;
}

}  // namespace

void add_merge_command(CommandLine& program) {
  auto options = std::make_shared<MergeOptions>();
  program
      .subcommand("merge",
                  "Puts sessions of several rigs on one clock, that of the first, and writes them "
                  "to any of the file sinks. Afferents are numbered through all sessions; the "
                  "names of patches and electrodes begin with the name of their session.",
                  "merge left.xdf right.xdf --sink nwb:both.nwb")
      .list("sessions", options->sessions,
            "Sessions, as recorded by --sink xdf:FILE; FILE@RIG for a rig in a file of LabRecorder")
      .required()
      .list("--sink", options->sinks, "Sink URI, repeatable: " + sink_schemes())
      .required()
      .option("--by-mark", options->mark,
              "Align by the marks with this label, which all sessions have equally often; default: "
              "by the UTC time that the hosts recorded")
      .flag("--by-pulses", options->pulses,
            "Align by the pulses of a sync line that all rigs are connected to, found by their "
            "intervals")
      .option("--limit-ms", options->limit_ms, "Largest residual of the alignment, ms", {0, 1e9})
      .flag("--accept-unknown", options->accept_unknown, "Also merge if the residual is unknown")
      .flag("--overwrite", options->overwrite, "Replace existing files")
      .runs([options] { return merge(*options); });
}

}  // namespace merkel
