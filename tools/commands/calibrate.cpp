#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <unistd.h>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/calibration/calibration_fit.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/files/utc_text.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/protocols/csv_text_style.hpp"
#include "tools/commands/command.hpp"
#include "tools/run/terminal_line.hpp"

namespace merkel {
namespace {

constexpr std::size_t kDepthPlace = 0;  ///< in kProbeChannels
constexpr std::size_t kForcePlace = 1;
constexpr std::string_view kTaxelKey = "pressure_kPa_per_";

struct CalibrateOptions {
  std::string uri;
  std::string file;
  std::string channel;
  std::string points = "0";
  double seconds = 2.0;
  std::optional<double> saturation;
  std::optional<double> area_mm2;
  bool overwrite = false;
  bool allow_remote = false;

  [[nodiscard]] bool of_taxels() const { return channel == "taxels"; }
  [[nodiscard]] std::size_t place() const { return channel == "depth" ? kDepthPlace : kForcePlace; }
  /// Of the points: the load on an array is a force.
  [[nodiscard]] Quantity quantity() const {
    return place() == kDepthPlace ? Quantity::kLength : Quantity::kForce;
  }
};

/// The known values in N or mm: "0,20g,50g".
Expected<std::vector<double>, SetupError> known_points(const CalibrateOptions& options) {
  std::vector<double> points;
  for (std::string_view rest = options.points; !rest.empty();) {
    const std::string_view part = take_field(rest);
    const CsvField field = parse_csv_field(part, false);
    const auto factor =
        field.unit.empty() ? std::optional(1.0) : factor_to(options.quantity(), field.unit);
    if (!field.number || !factor || !field.label.empty() || std::fabs(*field.number) > 1e6) {
      return bad_input(
          "--points has \"" + std::string(part) + "\": write numbers in " +
          std::string(unit_of(options.quantity())) + " or with a unit (" +
          std::string(options.quantity() == Quantity::kForce ? kForceUnits : kLengthUnits) +
          "), for example 0,20g,50g");
    }
    points.push_back(*field.number * *factor);
  }
  return points;
}

/// A device whose columns in volts or counts have stand-ins for their factors.
struct RawDevice {
  std::unique_ptr<Probe> probe;
  std::vector<std::pair<std::string, double>> stand_ins = {};
};

/// Whether the file calibrates the channel: then a single point replaces its zero alone.
bool has_channel(const CalibrateOptions& options) {
  std::error_code error;
  if (options.of_taxels() || !std::filesystem::is_regular_file(options.file, error)) return false;
  const auto present = read_calibration(options.file);
  return present && present->channels[options.place()];
}

/// The device, without the calibration of the file that is being written. \param tare  with it
Expected<RawDevice, SetupError> open_raw(const CalibrateOptions& options, bool tare) {
  RawDevice device;
  auto [uri, fragment] = split_fragment(options.uri);
  const std::string own = "calibration=" + options.file;
  const auto at = uri.find(own);
  if (at != std::string::npos && std::string("&").starts_with(uri.substr(at + own.size(), 1))) {
    uri.erase(at, own.size() + 1);
    if (uri.back() == '&' || uri.back() == '?') uri.pop_back();
  }
  if (uri.find("calibration=") != std::string::npos) {
    return bad_input(
        "remove calibration=… from the URI: a new calibration starts from raw readings");
  }
  const auto add = [&uri = uri](const std::string& option) {
    uri += std::string(uri.find('?') == std::string::npos ? "?" : "&") + option;
  };
  if (tare) add(own);
  constexpr std::size_t kMaxFactors = 64;
  for (;;) {
    auto probe = open_probe(uri + (fragment ? "#" + *fragment : ""), options.allow_remote);
    const std::string key = probe ? "" : UnitFactors::key_in(probe.error().sentence);
    if (probe) device.probe = std::move(*probe);
    if (!probe && (key.empty() || device.stand_ins.size() == kMaxFactors)) {
      return Unexpected<SetupError>(probe.error());
    }
    if (device.probe) break;
    // Within the limits of a reading also for the counts of a 32-bit converter.
    const double stand_in = key.ends_with("_count") ? 1e-6 : 1.0;
    device.stand_ins.emplace_back(key, stand_in);
    add(key + "=" + shortest_decimal(stand_in));
  }
  if (device.probe->status().calibration == nullptr) {
    return bad_input("\"" + options.uri +
                     "\" is not a single device: only a device can be calibrated");
  }
  return device;
}

/// Calls `take` with each reading of some seconds that begin now; shows what it returns ten times a
/// second.
template <class Take>
Expected<void, SetupError> read_for(Probe& probe, double seconds, TerminalLine& terminal,
                                    const Take& take) {
  constexpr std::chrono::milliseconds kRedraw{100};
  Readings readings = probe.readings();
  // Discards samples from before the load was applied.
  for (int reads = 0; reads < 1000; ++reads) {
    const auto old = probe.read(readings, std::chrono::milliseconds{0});
    if (!old || *old == 0) break;
  }
  const std::uint64_t saturated = probe.device_counts()->saturated;
  const auto begin = std::chrono::steady_clock::now();
  const auto end = begin + units::nanoseconds_from_s(seconds);
  auto next_redraw = begin;
  std::size_t taken = 0;
  ReadingBar bar;
  while (std::chrono::steady_clock::now() < end) {
    const auto count = probe.read(readings, std::chrono::milliseconds{50});
    terminal.print_notices(probe.take_notices());
    if (!count) return unavailable(probe.error_message());
    std::optional<LiveReading> live;
    for (std::size_t i = 0; i < *count; ++i) {
      const auto sample = readings.sample(i);
      if (!sample || sample->arrival < begin.time_since_epoch()) continue;
      live = take(*sample, readings.taxels(i));
      ++taken;
    }
    if (!live || std::chrono::steady_clock::now() < next_redraw) continue;
    next_redraw = std::chrono::steady_clock::now() + kRedraw;
    terminal.show({bar.text(*live), std::to_string(taken) + " readings"});
  }
  terminal.clear();
  if (probe.device_counts()->saturated == saturated) return {};
  return unavailable("the sensor is at the end of its range: calibrate with a smaller load");
}

void ask_for(double known, const CalibrateOptions& options) {
  if (::isatty(STDIN_FILENO) == 0) return;
  std::fprintf(stderr, "apply %g %s and press Enter: ", known,
               std::string(unit_of(options.quantity())).c_str());
  for (int c = std::getchar(); c != '\n' && c != EOF; c = std::getchar()) {
  }
}

/// Raw readings at each known value: the probe's own calibration is inverted.
Expected<std::vector<CalibrationPoint>, SetupError> measure_points(
    Probe& probe, const ChannelCalibration& natural, std::span<const double> known,
    const CalibrateOptions& options) {
  const bool force = options.place() == kForcePlace;
  TerminalLine terminal;
  std::vector<CalibrationPoint> points;
  for (const double value : known) {
    ask_for(value, options);
    CalibrationPoint point{.known = value, .readings = {}};
    auto read = read_for(probe, options.seconds, terminal, [&](const ProbeSample& sample, auto) {
      const double press = force ? units::N_from_mN(sample.force_mN) : sample.depth_mm;
      point.readings.push_back(press / natural.gain + natural.zero);
      LiveReading live;
      (force ? live.force_N : live.depth_mm) = point.readings.back();
      return live;
    });
    if (!read) return Unexpected<SetupError>(read.error());
    std::fprintf(stderr, "%g %s: %zu readings\n", value, force ? "N" : "mm", point.readings.size());
    points.push_back(std::move(point));
  }
  return points;
}

/// The calibration in an existing file, to which one is added; an empty one if there is no file.
Expected<ProbeCalibration, SetupError> present_calibration(const CalibrateOptions& options,
                                                           const std::string& serial_number) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(options.file, error)) return ProbeCalibration{};
  auto present = read_calibration(options.file);
  if (!present) {
    return bad_input(present.error().sentence + "; " + options.file +
                     " exists, and is not replaced: name another file");
  }
  if (!present->serial_number.empty() && present->serial_number != serial_number) {
    return bad_input(options.file + " is of the device with serial number " +
                     present->serial_number + ": name another file");
  }
  const bool has_taxels =
      std::any_of(present->factors.begin(), present->factors.end(),
                  [](const auto& factor) { return factor.first.starts_with(kTaxelKey); });
  const bool has =
      options.of_taxels() ? has_taxels : present->channels[options.place()].has_value();
  if (has && !options.overwrite) {
    return bad_input(options.file + " already calibrates " + options.channel +
                     ": add --overwrite to replace that; the rest of the file stays");
  }
  return present;
}

void set_factor(ProbeCalibration& calibration, const std::string& key, double factor) {
  std::erase_if(calibration.factors, [&](const auto& other) { return other.first == key; });
  calibration.factors.emplace_back(key, factor);
}

Expected<void, SetupError> calibrate_press(const RawDevice& device, std::span<const double> known,
                                           const CalibrateOptions& options,
                                           ProbeCalibration& result) {
  const auto& channel = device.probe->status().calibration->channels[options.place()];
  if (!channel) {
    return bad_input("the device at " + options.uri + " does not measure " + options.channel);
  }
  const auto stand_in =
      std::find_if(device.stand_ins.begin(), device.stand_ins.end(),
                   [&](const auto& each) { return each.first.starts_with(channel->stem() + "_"); });
  const bool electrical = stand_in != device.stand_ins.end();
  if (electrical && known.size() < 2) {
    return bad_input("the factor " + stand_in->first +
                     " needs two known values at least: add for example --points 0,20g");
  }
  const auto points = measure_points(*device.probe, *channel, known, options);
  if (!points) return Unexpected<SetupError>(points.error());
  const double limit = options.saturation.value_or(0.0) * (electrical ? stand_in->second : 1.0);
  for (const CalibrationPoint& point : *points) {
    const bool beyond = std::any_of(point.readings.begin(), point.readings.end(),
                                    [&](double reading) { return std::fabs(reading) >= limit; });
    if (!options.saturation || !beyond) continue;
    return unavailable("the sensor is at the end of its range: calibrate with a smaller load");
  }
  auto fitted = fit_calibration(*channel, *points);
  if (!fitted) return unavailable(fitted.error().sentence);
  const std::string unit(unit_of(options.quantity()));
  for (const CalibrationPoint& point : *points) {
    const double mean = std::accumulate(point.readings.begin(), point.readings.end(), 0.0) /
                        static_cast<double>(point.readings.size());
    const double value = fitted->gain * (mean - fitted->zero);
    std::printf("%g %s: the fit gives %.4g, residual %+.2g\n", point.known, unit.c_str(), value,
                value - point.known);
  }
  if (options.saturation) fitted->saturation = limit;
  if (electrical) {  // the gain is the factor: then readings are in N or mm
    const double gain = std::exchange(fitted->gain, 1.0);
    fitted->zero *= gain;
    if (fitted->saturation) *fitted->saturation *= std::fabs(gain);
    set_factor(result, stand_in->first, gain * stand_in->second);
    std::printf("%s = %.6g, ", stand_in->first.c_str(), gain * stand_in->second);
  }
  std::printf("zero %g %s, gain %g, residual %g %s, noise %g %s (rms)", fitted->zero, unit.c_str(),
              fitted->gain, fitted->residual, unit.c_str(), fitted->noise, unit.c_str());
  result.channels[options.place()] = *fitted;
  return {};
}

/// Mean pressures of the taxels at a load, in the unit of the stand-ins.
Expected<std::vector<double>, SetupError> mean_pressures(Probe& probe, double load_N,
                                                         const CalibrateOptions& options) {
  std::vector<double> sums(probe.info().taxels);
  std::size_t count = 0;
  TerminalLine terminal;
  ask_for(load_N, options);
  auto read = read_for(probe, options.seconds, terminal,
                       [&](const ProbeSample& sample, std::span<const double> taxels) {
                         for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += taxels[i];
                         ++count;
                         LiveReading live;
                         live.force_N = units::N_from_mN(sample.force_mN);
                         return live;
                       });
  if (!read) return Unexpected<SetupError>(read.error());
  std::fprintf(stderr, "%g N: %zu readings\n", load_N, count);
  if (count == 0) return unavailable("no reading arrived: measure longer");
  for (double& sum : sums) sum /= static_cast<double>(count);
  return sums;
}

/// One factor for all taxels: the known pressure, by the mean of the loaded taxels.
Expected<void, SetupError> calibrate_taxels(const RawDevice& device, std::span<const double> known,
                                            const CalibrateOptions& options,
                                            ProbeCalibration& result) {
  const auto stand_in =
      std::find_if(device.stand_ins.begin(), device.stand_ins.end(),
                   [](const auto& each) { return each.first.starts_with(kTaxelKey); });
  if (device.probe->info().taxels == 0 || stand_in == device.stand_ins.end()) {
    return bad_input(
        "\"" + options.uri +
        "\" is no array in counts or volts: name its columns so, and its taxels at the "
        "end of the URI, as in …?protocol=csv&columns=taxel_count*64#taxels=64");
  }
  const double largest = known.empty() ? 0.0 : *std::max_element(known.begin(), known.end());
  if (!options.area_mm2 || !(largest > 0.0)) {
    return bad_input(
        "taxels are calibrated by a known weight over a known area: add for example --points "
        "0,200g --area-mm2 100");
  }
  double xy = 0.0;
  double xx = 0.0;
  for (const double load_N : known) {
    const auto means = mean_pressures(*device.probe, load_N, options);
    if (!means) return Unexpected<SetupError>(means.error());
    if (load_N <= 0.0) continue;  // the array measured its zero when it was opened
    const double most = *std::max_element(means->begin(), means->end());
    double sum = 0.0;
    double loaded = 0.0;
    for (const double mean : *means) {
      if (!(mean > 0.5 * most)) continue;
      sum += mean;
      ++loaded;
    }
    if (loaded == 0.0) {
      return unavailable("no taxel rose above its noise at " + shortest_decimal(load_N) +
                         " N: place the weight on the array after its zero is measured");
    }
    const double pressure_kPa = units::mN_from_N(load_N) / *options.area_mm2;
    std::printf("%g N: %g kPa on %g loaded taxels\n", load_N, pressure_kPa, loaded);
    xy += sum / loaded * pressure_kPa;
    xx += sum / loaded * (sum / loaded);
  }
  const double factor = stand_in->second * xy / xx;
  set_factor(result, stand_in->first, factor);
  std::printf("%s = %.6g", stand_in->first.c_str(), factor);
  return {};
}

int calibrate(const CalibrateOptions& options) {
  if (options.channel != "force" && options.channel != "depth" && !options.of_taxels()) {
    return refuse("--channel must be force, depth or taxels, but is \"" + options.channel + "\"");
  }
  const auto known = known_points(options);
  if (!known) return refuse(known.error());
  std::error_code error;
  const bool exists = std::filesystem::is_regular_file(options.file, error);
  auto file = OutputFile::create(options.file, exists || options.overwrite);
  if (!file) return refuse(file.error());
  const auto device = open_raw(options, known->size() == 1 && has_channel(options));
  if (!device) return refuse(device.error());
  const std::string serial_number = device->probe->info().serial_number;
  auto result = present_calibration(options, serial_number);
  if (!result) return refuse(result.error());
  const auto done = options.of_taxels() ? calibrate_taxels(*device, *known, options, *result)
                                        : calibrate_press(*device, *known, options, *result);
  if (!done && done.error().kind == SetupError::Kind::kUnavailable) {
    return fail(done.error().sentence);
  }
  if (!done) return refuse(done.error());
  result->serial_number = serial_number;
  result->date = utc_text(std::time(nullptr), "%Y-%m-%dT%H:%M:%SZ");
  const std::string text = calibration_text(*result, "merkel calibrate '" + options.uri + "'");
  if (!file->write(text) || !file->close()) return fail(file->error());
  std::printf("; use it with calibration=%s\n", options.file.c_str());
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
          "adds them to a file for the option calibration=FILE of its URI. With one point "
          "only the zero is set (tare). Columns in volts or counts (force_V) get their factor "
          "(force_N_per_V). In a terminal, each point waits for Enter; otherwise the points "
          "follow one another without a pause.",
          "calibrate 'serial:/dev/ttyUSB0?protocol=hbf1' gauge.toml --points 0,50g,100g,200g")
      .option("uri", options->uri, "Probe URI")
      .required()
      .option("file", options->file,
              "Calibration file (TOML): the channel is added to those that it has")
      .required()
      .option("--channel", options->channel,
              "What to calibrate: force (N), depth (mm), or taxels of an array in counts or volts, "
              "by a weight over --area-mm2")
      .option("--points", options->points, "Known values, in N or mm, or with a unit: 0,20g,50g")
      .option("--area-mm2", options->area_mm2, "Area under the weights on an array", {1e-3, 1e6})
      .option("--seconds", options->seconds, "Duration of each point, s", {0.05, 600})
      .option("--saturation", options->saturation,
              "Readings of at least this magnitude count as saturated", {1e-9, 1e12})
      .flag("--overwrite", options->overwrite,
            "Replace this channel's calibration in the file; with one point its zero alone")
      .flag("--allow-remote", options->allow_remote, kRemoteProbesHelp)
      .runs([options] { return calibrate(*options); });
}

}  // namespace merkel
