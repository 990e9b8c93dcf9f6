#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <unistd.h>

#include "core/units.hpp"
#include "drivers/probes/open_probe.hpp"
#include "tools/child_process.hpp"
#include "tools/commands/command.hpp"
#include "tools/doctor/cyclictest.hpp"
#include "tools/doctor/device_verdicts.hpp"
#include "tools/doctor/machine_verdicts.hpp"
#include "tools/doctor/path_verdicts.hpp"
#include "tools/doctor/probe_report.hpp"
#include "tools/filled_text.hpp"
#include "tools/json_text.hpp"
#include "tools/run/counter_text.hpp"
#include "tools/run/loop_summary.hpp"
#include "tools/run/status_line.hpp"
#include "tools/run/stop_signal.hpp"
#include "tools/run/terminal_line.hpp"

namespace merkel {
namespace {

struct DoctorOptions {
  std::string probe;
  double seconds = 10.0;
  double runs = 1.0;
  double tick_us = 1000.0;
  bool sleep = false;
  bool normal = false;
  bool stress = false;
  bool page = false;
  bool json = false;
};

Json json_of(const std::vector<Verdict>& verdicts) {
  Json all = Json::array();
  for (const Verdict& verdict : verdicts) {
    all.push_back({{"what", verdict.what},
                   {"grade", name_of(verdict.grade)},
                   {"finding", verdict.finding},
                   {"remedy", verdict.remedy}});
  }
  return all;
}

Json json_of(const ConsumerLatency& consumer) {
  return {{"spikes", consumer.spikes},
          {"missing", consumer.missing},
          {"unmatched", consumer.unmatched},
          {"sink", latency_json(consumer.sink)},
          {"software", latency_json(consumer.software)},
          {"sample_to_received", latency_json(consumer.sample_to_received)}};
}

Json json_of(const DoctorRun& run) {
  const RunReport& report = run.path.report;
  const RunReport::ProbeReport& probe = report.probes.front();
  Json json = {{"missed", run.path.missed()},
               {"missed_fraction", run.path.missed_fraction()},
               {"steal_ms", units::ms_from(run.path.steal)},
               {"samples_in", probe.samples_in},
               {"samples_used", probe.counts.used},
               {"samples_late", probe.counts.late},
               {"samples_dropped", probe.dropped},
               {"samples_unused", probe.unused},
               {"loop", loop_json(report)},
               {"cyclictest", run.cyclictest ? latency_json(*run.cyclictest) : Json()}};
  add_counters(json, report);
  for (const ConsumerLatency& consumer : run.path.consumers) json[consumer.key] = json_of(consumer);
  return json;
}

void print(const DoctorRun& run, std::size_t number) {
  Json facts = json_of(run);
  facts["number"] = number;
  for (const ConsumerLatency& of : run.path.consumers) {
    facts["consumers"].push_back(json_of(of));
    facts["consumers"].back()["name"] = of.name;
  }
  std::fputs(filled_text("doctor_run", facts).c_str(), stdout);
}

void print(const std::vector<Verdict>& verdicts) {
  std::fputs(filled_text("doctor_verdicts", json_of(verdicts)).c_str(), stdout);
}

/// Measures how a device keeps time, and its drift while nothing touches it, instead of the
/// machine.
int doctor_of_probe(const DoctorOptions& options) {
  const auto probe = open_probe(options.probe);
  if (!probe) return refuse(probe.error());
  if ((*probe)->info().replayed) {
    return refuse("\"" + options.probe + "\" is a recording or simulation, which has no drift");
  }
  const auto report = ProbeReport::measure(**probe, options.seconds);
  if (!report) return refuse(report.error());
  std::fputs((options.json ? json_text(report->json()) : report->text()).c_str(), stdout);
  return kDone;
}

int doctor(const DoctorOptions& options) {
  if (!options.probe.empty()) return doctor_of_probe(options);
  PathSettings settings{.duration = units::nanoseconds_from_s(options.seconds),
                        .tick = units::nanoseconds_from_ms(1e-3 * options.tick_us),
                        .page = options.page,
                        .wait = options.sleep ? LoopWait::kSleep : LoopWait::kHybrid};
  settings.realtime.fifo = !options.normal;
  auto machine = machine_verdicts(MachineFacts::read(), settings.realtime.priority);
  for (Verdict& verdict : device_verdicts(DeviceSetUp::read())) {
    machine.push_back(std::move(verdict));
  }
  if (!options.json) print(machine);

  std::optional<ChildProcess> stress;
  if (options.stress) {
    stress.emplace(std::vector<std::string>{"stress-ng", "--cpu", "2"});
    if (!stress->started()) {
      return refuse("--stress needs the program stress-ng: apt install stress-ng");
    }
  }
  StatusLine status;
  TerminalLine terminal;
  const auto on_progress = [&](const RunProgress& progress) {
    if (terminal.on_terminal()) terminal.show(status.fields(progress));
  };
  std::unique_ptr<StopSignal> stop;
  const auto started = [&stop](Pipeline* pipeline) {
    stop = pipeline == nullptr ? nullptr : std::make_unique<StopSignal>(*pipeline);
  };
  std::vector<DoctorRun> runs;
  const auto wanted = static_cast<std::size_t>(options.runs);
  for (std::size_t i = 0; i < wanted; ++i) {
    status = StatusLine();
    auto path = measure_path(settings, on_progress, started);
    terminal.clear();
    if (!path) return refuse(path.error());
    const bool interrupted = path->report.interrupted;
    const RealtimeRights rights = path->report.host_time->rights;
    DoctorRun run{.path = std::move(*path), .cyclictest = std::nullopt};
    if (!interrupted) {
      const auto longest = std::chrono::nanoseconds(std::chrono::minutes{1});
      run.cyclictest = run_cyclictest(std::min(settings.duration, longest), settings.tick, rights);
    }
    runs.push_back(std::move(run));
    if (!options.json) print(runs.back(), i + 1);
    if (interrupted) break;
  }
  const auto verdicts = path_verdicts(runs);
  if (!options.json) {
    if (runs.size() > 1) std::printf("medians of %zu runs:\n", runs.size());
    print(verdicts);
    return kDone;
  }
  Json all = Json::array();
  for (const DoctorRun& run : runs) all.push_back(json_of(run));
  const Json result = {{"tick_us", options.tick_us},   {"seconds", options.seconds},
                       {"stress", options.stress},     {"page", options.page},
                       {"machine", json_of(machine)},  {"runs", std::move(all)},
                       {"verdicts", json_of(verdicts)}};
  std::fputs(json_text(result).c_str(), stdout);
  return kDone;
}

}  // namespace

void add_doctor_command(CommandLine& program) {
  auto options = std::make_shared<DoctorOptions>();
  program
      .subcommand(
          "doctor",
          "Checks how well this machine keeps time: rights and settings, the requirements of "
          "devices, and the whole path from a live simulated probe to a polling consumer and a "
          "ZeroMQ subscriber. Prints the latency of each stage in µs, next to that of cyclictest if "
          "rt-tests is installed. Each verdict comes with its remedy.",
          "doctor --seconds 60")
      .option(
          "--probe", options->probe,
          "Measure this device instead, while nothing touches it, for --seconds or until Ctrl-C: its "
          "rate and jitter, what is lost, the processor time of a read, and its drift")
      .option("--seconds", options->seconds, "How long to measure, in s", {0.2, 1e6})
      .option("--runs", options->runs, "Number of runs; the verdicts use their medians",
              {1.0, 1000.0})
      .option("--tick-us", options->tick_us, "The tick, in µs: a multiple of 25", {50.0, 1e5})
      .flag("--sleep", options->sleep, "Only sleep until each tick, without spinning")
      .flag("--normal", options->normal, "Use SCHED_OTHER even if SCHED_FIFO is permitted")
      .flag("--stress", options->stress, "Run stress-ng --cpu 2 during the measurement")
      .flag("--page", options->page, "Also serve the live page to eight clients that read nothing")
      .flag("--json", options->json, "Print the results as JSON")
      .runs([options] { return doctor(*options); });
}

}  // namespace merkel
