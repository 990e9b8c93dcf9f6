#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "drivers/sinks/open_sink.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/export_run.hpp"
#include "tools/print_text.hpp"
#include "tools/run/recorded_session.hpp"

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
  const auto zero = time_zero_named(options.time_zero);
  if (!zero) return refuse(zero.error());
  auto opened = RecordedSession::open(options.session);
  if (!opened) return refuse(opened.error());
  const std::shared_ptr<RecordedSession> session = std::move(*opened);
  std::uint64_t spikes = 0;
  const int exit_code = export_run(session, session->origin(), options.sinks,
                                   {.neurons = session->neurons(),
                                    .overwrite = options.overwrite,
                                    .allow_remote = options.allow_remote,
                                    .run = session->run(),
                                    .time_zero = *zero},
                                   spikes);
  if (exit_code != kDone) return exit_code;
  print_text(stderr, "{} spikes exported{}\n", spikes,
             session->complete() ? "" : "; the recording is incomplete and ends there");
  return kDone;
}

}  // namespace

Expected<TimeZero, std::string> time_zero_named(const std::string& name) {
  if (name == "session") return TimeZero::kRun;
  if (name == "unix") return TimeZero::kUnix;
  if (name == "device") return TimeZero::kDevice;
  return Unexpected<std::string>("--time-zero " + name + " is not one of session, unix, device");
}

int export_run(const std::shared_ptr<RunJournal>& run, const RunOrigin& origin,
               std::span<const std::string> uris, SinkSetup setup, std::uint64_t& spikes) {
  setup.notice = setup.progress = warn;
  setup.journal = run;
  const auto opened = open_separate_sinks(uris, setup);
  if (!opened) return refuse(opened.error());
  const auto& sinks = *opened;
  if (const auto written = write_run(*run, origin, sinks, spikes); !written) {
    return written.error().kind == SetupError::Kind::kBadInput ? refuse(written.error())
                                                               : fail(written.error().sentence);
  }
  for (const auto& sink : sinks) {
    if (sink->takes<SpikeEvent>() && sink->delivered() < spikes) {
      print_text(stderr, "merkel: {}: {} of {} spikes did not arrive\n", sink->uri(),
                 spikes - sink->delivered(), spikes);
    }
  }
  return kDone;
}

void add_export_command(CommandLine& program) {
  auto options = std::make_shared<ExportOptions>();
  program
      .subcommand("export",
                  "Converts a recorded session to other formats, by any of the sinks: spikes, "
                  "stimulus, positions, events and marks, as far as the format can hold them.",
                  "export session.xdf --sink nwb:session.nwb --sink trace:press.csv")
      .option("session", options->session, kSessionHelp)
      .required()
      .list("--sink", options->sinks, "Sink URI, repeatable: " + sink_schemes())
      .required()
      .option("--time-zero", options->time_zero,
              "Zero of the times in files: session (its start), unix (1970-01-01) or "
              "device (the probe's own time)")
      .flag("--overwrite", options->overwrite, "Replace existing files")
      .flag("--allow-remote", options->allow_remote, kRemoteSinksHelp)
      .runs([options] { return export_session(*options); });
}

}  // namespace merkel
