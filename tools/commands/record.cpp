#include <atomic>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/files/trace_file.hpp"
#include "drivers/probes/open_probe.hpp"
#include "tools/commands/command.hpp"

namespace merkel {
namespace {

struct RecordOptions {
  std::string uri;
  std::string file;
  std::optional<double> duration_s;
  bool overwrite = false;
};

std::atomic<bool> g_stop{false};

void stop_recording(int /*signal*/) { g_stop.store(true); }

int record(const RecordOptions& options) {
  auto probe = open_probe(options.uri);
  if (!probe) return refuse(probe.error());
  std::string command = "merkel record '" + options.uri + "' " + options.file;
  if (options.duration_s) command += " --duration-s " + shortest_decimal(*options.duration_s);
  const std::vector<std::string> comment = {command};
  auto trace =
      TraceWriter::create(options.file, (*probe)->info().channels, comment, options.overwrite);
  if (!trace) return refuse(trace.error());

  std::signal(SIGINT, stop_recording);
  std::signal(SIGTERM, stop_recording);
  std::vector<ProbeSample> samples(1024);
  std::optional<std::chrono::nanoseconds> end;
  std::uint64_t written = 0;
  while (!g_stop.load()) {
    const auto count = (*probe)->read(samples, std::chrono::milliseconds{100});
    for (const std::string& sentence : (*probe)->take_notices()) {
      std::fprintf(stderr, "merkel: %s\n", sentence.c_str());
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
    if (auto done = trace->write(std::span(samples).first(wanted)); !done) {
      return fail(done.error().sentence);
    }
    written += wanted;
    if (wanted < *count) break;
  }
  if (auto done = trace->close(); !done) return fail(done.error().sentence);
  std::fprintf(stderr, "%llu samples written to %s\n", static_cast<unsigned long long>(written),
               options.file.c_str());
  return kDone;
}

}  // namespace

void add_record_command(CommandLine& program) {
  auto options = std::make_shared<RecordOptions>();
  program
      .subcommand("record", "Writes a probe's samples to a trace file (CSV).",
                  "record 'sim:taps?depth_mm=1' taps.csv")
      .option("uri", options->uri, "Probe URI")
      .required()
      .option("file", options->file, "Trace file to write")
      .required()
      .option("--duration-s", options->duration_s, "Stop after so many seconds", {1e-6, 1e9})
      .flag("--overwrite", options->overwrite, "Replace a file that exists")
      .runs([options] { return record(*options); });
}

}  // namespace merkel
