#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/parameters/nearest_name.hpp"
#include "core/units.hpp"
#include "drivers/files/example_file.hpp"
#include "drivers/protocols/protocol_table.hpp"
#include "drivers/protocols/trace_file.hpp"
#include "drivers/simulation/device_simulator.hpp"
#include "realtime/threads/thread_setup.hpp"
#include "tools/commands/command.hpp"
#include "tools/print_text.hpp"
#include "tools/run/stop_signal.hpp"

namespace merkel {
namespace {

struct SimulateOptions {
  std::string protocol;
  std::string trace;
  std::string link;
  std::string network;
  std::optional<double> baud;
  std::optional<double> rate_hz;
  std::optional<double> duration_s;
  bool repeat = false;
  bool split = false;
  bool echo = false;
  double drop_byte = 0.0;
  double flip_byte = 0.0;
  double drop_frame = 0.0;
  double batch_ms = 0.0;
  std::optional<double> stall_s;
  double stall_for_s = 0.5;
  std::optional<double> unplug_s;
  double unplug_for_s = 0.5;
  std::optional<double> reboot_s;
  double drift_ppm = 0.0;
  std::optional<std::uint64_t> seed;
  std::optional<std::uint64_t> pulses;
};

struct PlayedTrace {
  std::vector<ProbeSample> samples;
  std::vector<std::string> extra_columns;
  std::vector<std::string> taxels;  ///< in kPa
  std::vector<double> others;       ///< a row of both for each sample
};

/// The names of taxels with the unit of the pressures that are sent.
std::string in_kPa(const std::string& name) { return name.substr(0, name.rfind('_')) + "_kPa"; }

Expected<PlayedTrace, SetupError> read_trace(const std::string& path) {
  auto reader = TraceReader::open(path);
  if (!reader) return Unexpected<SetupError>(reader.error());
  PlayedTrace trace;
  constexpr std::size_t kAtOnce = 4096;
  Readings chunk(ReadingColumns(reader->columns()), kAtOnce);
  while (true) {
    chunk.clear();
    const auto count = reader->read(chunk, kAtOnce);
    if (!count) return Unexpected<SetupError>(count.error());
    if (*count == 0) break;
    for (std::size_t i = 0; i < chunk.size(); ++i) {
      trace.samples.push_back(*chunk.sample(i));
      const auto others = std::as_const(chunk).row(i).subspan(ProbeColumns::kPress);
      trace.others.insert(trace.others.end(), others.begin(), others.end());
    }
  }
  if (trace.samples.empty()) return bad_input(path + " holds no samples to play");
  trace.extra_columns = reader->extra_columns();
  for (const std::string& name : reader->taxels()) trace.taxels.push_back(in_kPa(name));
  return trace;
}

int simulate(const SimulateOptions& options) {
  const auto protocol = find_protocol(options.protocol);
  if (!protocol) return refuse(protocol.error());
  auto trace = read_trace(path_or_example(Example::kTrace, options.trace));
  if (!trace) return refuse(trace.error());
  const auto time = [](std::optional<double> seconds) {
    return seconds ? std::optional(units::nanoseconds_from_s(*seconds)) : std::nullopt;
  };
  DeviceSimulator::Settings settings{
      .protocol = *protocol,
      .trace = std::move(trace->samples),
      .extra_columns = std::move(trace->extra_columns),
      .taxels = std::move(trace->taxels),
      .others = std::move(trace->others),
      .baud = options.baud ? static_cast<int>(*options.baud) : (*protocol)->baud,
      .link = options.link,
      .network = options.network,
      .repeat = options.repeat,
      .pulses = options.pulses ? std::optional(static_cast<std::uint32_t>(*options.pulses))
                               : std::nullopt,
      .rate_Hz = options.rate_hz,
      .faults = {.drop_byte = options.drop_byte,
                 .flip_byte = options.flip_byte,
                 .drop_frame = options.drop_frame,
                 .split = options.split,
                 .batch = units::nanoseconds_from_ms(options.batch_ms),
                 .stall_at = time(options.stall_s),
                 .stall_for = units::nanoseconds_from_s(options.stall_for_s),
                 .unplug_at = time(options.unplug_s),
                 .unplug_for = units::nanoseconds_from_s(options.unplug_for_s),
                 .reboot_at = time(options.reboot_s),
                 .echo = options.echo,
                 .drift_ppm = options.drift_ppm,
                 .seed = options.seed.value_or(1)}};
  if (options.unplug_s && options.link.empty() && options.network.empty()) {
    return refuse(
        "--unplug-s needs --link, because the pseudo-terminal returns under another name");
  }
  auto simulator = DeviceSimulator::create(std::move(settings));
  if (!simulator) return refuse(simulator.error());

  std::atomic<bool> stop{false};
  const StopSignal stop_signal(stop);
  std::printf("%s\n", (*simulator)->uri().c_str());
  std::fflush(stdout);
  std::jthread alarm;
  if (options.duration_s) {
    alarm = std::jthread([&stop, seconds = *options.duration_s](const std::stop_token& token) {
      const auto end = std::chrono::steady_clock::now() + units::nanoseconds_from_s(seconds);
      while (!token.stop_requested() && std::chrono::steady_clock::now() < end) {
        std::this_thread::sleep_for(std::chrono::milliseconds{10});
      }
      stop.store(true);
    });
  }
  std::jthread([&] {
    set_up_device_thread();
    (*simulator)->run(stop);
  }).join();
  const DeviceSimulator::Counts& counts = (*simulator)->counts();
  print_text(stderr,
             "{} samples generated, {} of them not sent, {} frames dropped; {} bytes sent, {} "
             "dropped, {} flipped, {} not read in time\n",
             counts.measured, counts.unsent, counts.frames_dropped, counts.bytes_sent,
             counts.bytes_dropped, counts.bytes_flipped, counts.bytes_overrun);
  return kDone;
}

}  // namespace

void add_simulate_probe_command(CommandLine& program) {
  auto options = std::make_shared<SimulateOptions>();
  const std::string names =
      listed(protocol_table(), &ProtocolEntry::name) + ", " + std::string(ati_rdt_entry().name);
  program
      .subcommand(
          "simulate-probe",
          "Simulates a device that sends a trace, on a pseudo-terminal, and prints the probe URI "
          "to read from. The trace starts when a host opens the port. Has real-time priority where permitted: a device does not wait for this machine.",
          "simulate-probe hbf1 --trace taps --link /tmp/probe")
      .option("protocol", options->protocol, "Protocol of the device: " + names)
      .required()
      .option("--trace", options->trace,
              "Trace file to play (CSV), or taps, ramp_and_hold, slide or faulty")
      .required()
      .option("--link", options->link, "Symbolic link to create to the terminal")
      .option("--network", options->network,
              "Use the network instead of a terminal: udp:HOST:PORT or tcp:HOST:PORT")
      .option("--baud", options->baud, "Baud rate; a host that uses another rate reads garbage",
              {50, 12e6})
      .option("--rate-hz", options->rate_hz,
              "Measurements per second, and rate_hz of the URI; default: those of the trace",
              {0.1, 20'000})
      .flag("--repeat", options->repeat, "Start again at the end of the trace")
      .option("--duration-s", options->duration_s, "Stop after this time, s", {1e-3, 1e9})
      .option("--drop-byte", options->drop_byte, "Probability of losing a byte", {0, 1})
      .option("--flip-byte", options->flip_byte, "Probability of a wrong bit in a byte", {0, 1})
      .option("--drop-frame", options->drop_frame, "Probability of losing a frame", {0, 1})
      .flag("--split", options->split, "Split and merge frames")
      .option("--batch-ms", options->batch_ms, "Collect bytes and send them at this interval, ms",
              {0, 1000})
      .option("--stall-s", options->stall_s, "Stop sending at this time of the trace, s", {0, 1e9})
      .option("--stall-for-s", options->stall_for_s,
              "Duration of the stall, s; the delayed data is then sent at once", {0, 1e9})
      .option("--unplug-s", options->unplug_s, "Unplug at this time, s", {0, 1e9})
      .option("--unplug-for-s", options->unplug_for_s, "Plug in again after this time, s", {0, 1e9})
      .option("--reboot-s", options->reboot_s, "Restart the device at this time, s", {0, 1e9})
      .flag("--echo", options->echo, "Echo the host's bytes")
      .option("--drift-ppm", options->drift_ppm, "Drift of the device's clock; positive is fast",
              {-10000, 10000})
      .option("--pulses", options->pulses,
              "Make the irregular pulses of a sync line from this seed (hbf1)")
      .option("--seed", options->seed, "Seed of the faults")
      .runs([options] { return simulate(*options); });
}

}  // namespace merkel
