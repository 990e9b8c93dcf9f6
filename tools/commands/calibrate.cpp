#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include <unistd.h>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/calibration/calibration_fit.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/probes/open_probe.hpp"
#include "tools/commands/command.hpp"
#include "tools/run/terminal_line.hpp"

namespace merkel {
namespace {

struct CalibrateOptions {
  std::string uri;
  std::string file;
  std::string channel;
  std::vector<double> points = {0.0};
  double seconds = 2.0;
  std::optional<double> saturation;
  bool overwrite = false;
  bool allow_remote = false;
};

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text.data();
}

/// Reads for `seconds` and inverts the probe's present calibration. \return raw readings
Expected<std::vector<double>, SetupError> measure(Probe& probe, std::size_t channel, double seconds,
                                                  std::optional<double> saturation,
                                                  TerminalLine& terminal) {
  const ChannelCalibration& natural = *probe.status().calibration->channels[channel];
  std::vector<double> readings;
  std::vector<ProbeSample> samples(1024);
  // Discards samples from before the load was applied.
  for (int reads = 0; reads < 1000; ++reads) {
    const auto old = probe.read(samples, std::chrono::milliseconds{0});
    if (!old || *old == 0) break;
  }
  const std::uint64_t saturated_before = probe.device_counts()->saturated;
  const auto begin = std::chrono::steady_clock::now();
  const auto end = begin + units::nanoseconds_from_s(seconds);
  ReadingBar bar;
  while (std::chrono::steady_clock::now() < end) {
    const auto count = probe.read(samples, std::chrono::milliseconds{50});
    if (!count) return unavailable(probe.error_message());
    for (std::size_t i = 0; i < *count; ++i) {
      if (samples[i].arrival < begin.time_since_epoch()) continue;
      const double value =
          channel == 0 ? samples[i].depth_mm : units::N_from_mN(samples[i].force_mN);
      readings.push_back(value / natural.gain + natural.zero);
    }
    if (readings.empty()) continue;
    LiveReading live;
    (channel == 0 ? live.depth_mm : live.force_N) = readings.back();
    terminal.show({bar.text(live), std::to_string(readings.size()) + " readings"});
  }
  if (probe.device_counts()->saturated > saturated_before ||
      std::any_of(readings.begin(), readings.end(), [&](double reading) {
        return saturation && std::fabs(reading) >= *saturation;
      })) {
    return unavailable("the sensor is at the end of its range: calibrate with a smaller load");
  }
  return readings;
}

int calibrate(const CalibrateOptions& options) {
  auto opened = open_probe(options.uri, options.allow_remote);
  if (!opened) return refuse(opened.error());
  Probe* const probe = opened->get();
  if (probe->status().calibration == nullptr) {
    return refuse("\"" + options.uri +
                  "\" is not a single device: only a device can be calibrated");
  }
  if (options.uri.find("calibration=") != std::string::npos) {
    return refuse("remove calibration=… from the URI: a new calibration starts from raw readings");
  }
  const bool force = options.channel == "force";
  if (!force && options.channel != "depth") {
    return refuse("--channel must be force or depth, but is \"" + options.channel + "\"");
  }
  const std::size_t channel = force ? 1 : 0;
  const char* const unit = force ? "N" : "mm";
  const ProbeCalibration calibration = *probe->status().calibration;
  if (!calibration.channels[channel]) {
    return refuse("the device at " + options.uri + " does not measure " + options.channel);
  }
  auto file = OutputFile::create(options.file, options.overwrite);
  if (!file) return refuse(file.error());

  const bool asks = ::isatty(STDIN_FILENO) != 0;
  TerminalLine terminal;
  std::vector<CalibrationPoint> points;
  for (const double known : options.points) {
    if (asks) {
      std::fprintf(stderr, "apply %g %s and press Enter: ", known, unit);
      for (int c = std::getchar(); c != '\n' && c != EOF; c = std::getchar()) {
      }
    }
    auto readings = measure(*probe, channel, options.seconds, options.saturation, terminal);
    if (!readings) return fail(readings.error().sentence);
    terminal.clear();
    std::fprintf(stderr, "%g %s: %zu readings\n", known, unit, readings->size());
    points.push_back({known, std::move(*readings)});
  }
  auto fitted = fit_calibration(*calibration.channels[channel], points);
  if (!fitted) return fail(fitted.error().sentence);
  fitted->saturation = options.saturation;
  ProbeCalibration result;
  result.serial_number = probe->info().serial_number;
  result.date = today();
  result.channels[channel] = *fitted;
  const std::string text = calibration_text(result, "merkel calibrate '" + options.uri + "'");
  if (!file->write(text) || !file->close()) return fail(file->error());
  for (const CalibrationPoint& point : points) {
    const double mean = std::accumulate(point.readings.begin(), point.readings.end(), 0.0) /
                        static_cast<double>(point.readings.size());
    const double value = fitted->gain * (mean - fitted->zero);
    std::printf("%g %s: the fit gives %.4g, residual %+.2g\n", point.known, unit, value,
                value - point.known);
  }
  std::printf(
      "zero %g %s, gain %g, residual %g %s, noise %g %s (rms); use it with calibration=%s\n",
      fitted->zero, unit, fitted->gain, fitted->residual, unit, fitted->noise, unit,
      options.file.c_str());
  return kDone;
}

}  // namespace

void add_calibrate_command(CommandLine& program) {
  auto options = std::make_shared<CalibrateOptions>();
  options->channel = "force";
  program
      .subcommand(
          "calibrate",
          "Measures zero, gain, sign and noise of a device at known loads or depths, and "
          "writes them to a file for the option calibration=FILE of its URI. With one point "
          "only the zero is set (tare). In a terminal, each point waits for Enter; otherwise the points "
          "follow one another without a pause.",
          "calibrate 'serial:/dev/ttyUSB0?protocol=hbf1' force.toml --points 0,0.5,1,2")
      .option("uri", options->uri, "Probe URI")
      .required()
      .option("file", options->file, "Calibration file to write (TOML)")
      .required()
      .option("--channel", options->channel, "Channel to calibrate: force (N) or depth (mm)")
      .list("--points", options->points, "Known values, in N or mm", {-1e4, 1e4})
      .option("--seconds", options->seconds, "Duration of each point, s", {0.05, 600})
      .option("--saturation", options->saturation,
              "Readings of at least this magnitude count as saturated", {1e-9, 1e6})
      .flag("--overwrite", options->overwrite, "Replace an existing file")
      .flag("--allow-remote", options->allow_remote,
            "Allow other machines to send the samples (udp:0.0.0.0:PORT)")
      .runs([options] { return calibrate(*options); });
}

}  // namespace merkel
