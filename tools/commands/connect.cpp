#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fmt/core.h>
#include <unistd.h>

#include "core/parameters/parameter_error.hpp"
#include "core/printed.hpp"
#include "core/units.hpp"
#include "drivers/calibration/probe_calibration.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/protocol_table.hpp"
#include "drivers/transports/device_list.hpp"
#include "drivers/uri.hpp"
#include "tools/commands/command.hpp"
#include "tools/connect/array_scene.hpp"
#include "tools/connect/hand_scene.hpp"
#include "tools/connect/reading_choice.hpp"
#include "tools/connect/recognition.hpp"
#include "tools/connect/rest_drift.hpp"
#include "tools/connect/skin_contact.hpp"
#include "tools/filled_text.hpp"
#include "tools/run/device_summary.hpp"
#include "tools/run/stop_signal.hpp"
#include "tools/scene/scene_file.hpp"
#include "tools/scene/scene_keys.hpp"

namespace merkel {
namespace {

/// How a card is read whose channels have no names yet.
constexpr std::string_view kGuessedCard = "columns=force_V&force_N_per_V=1";

struct ConnectOptions {
  std::string target;
  std::string out = "connected.toml";
  double wait_s = 30.0;
  double rest_s = 0.0;
  double skin_s = 0.0;
  bool yes = false;
  bool overwrite = false;
  bool allow_remote = false;
};

/// Waits for a serial port until it exists.
Expected<std::string, SetupError> wait_for_port(const std::string& port, double wait_s) {
  const auto end = std::chrono::steady_clock::now() + units::nanoseconds_from_s(wait_s);
  std::error_code error;
  if (!std::filesystem::exists(port, error)) {
    std::fprintf(stderr, "%s does not exist yet: plug the device in; waiting …\n", port.c_str());
  }
  while (!std::filesystem::exists(port, error)) {
    if (std::chrono::steady_clock::now() >= end) {
      return unavailable(fmt::format(
          "{} did not appear within {:g} s: plug the device in, check the name with merkel probes, "
          "or wait longer with --wait-s",
          port, wait_s));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds{100});
  }
  return "serial:" + port;
}

/// The given address; without one, the first serial device, waiting until one is plugged in.
Expected<std::string, SetupError> address_of(const ConnectOptions& options) {
  if (options.target.find(':') != std::string::npos) return options.target;
  if (!options.target.empty()) return wait_for_port(options.target, options.wait_s);
  const auto end = std::chrono::steady_clock::now() + units::nanoseconds_from_s(options.wait_s);
  bool announced = false;
  do {
    std::vector<DeviceEntry> serial;
    for (DeviceEntry& entry : list_devices()) {
      // A built-in port exists whether or not something is connected to it: it must be named.
      const bool built_in = entry.uri.starts_with("serial:/dev/ttyS");
      if (entry.uri.starts_with("serial:") && !built_in) serial.push_back(std::move(entry));
    }
    for (const DeviceEntry& entry : serial) {
      if (!entry.usable) continue;
      std::fprintf(stderr, "found %s (%s)\n", entry.uri.c_str(), entry.name.c_str());
      return entry.uri;
    }
    if (!serial.empty()) return unavailable(serial.front().uri + ": " + serial.front().remedy);
    if (!announced) std::fprintf(stderr, "no USB serial device found: plug one in; waiting …\n");
    announced = true;
    std::this_thread::sleep_for(std::chrono::milliseconds{300});
  } while (std::chrono::steady_clock::now() < end);
  return unavailable(
      "no serial device was plugged in: pass a port or an address, for example merkel connect "
      "/dev/ttyUSB0");
}

/// Recognises the protocol at an address without options. \return the whole URI
Expected<std::string, SetupError> recognised(const std::string& address,
                                             const ConnectOptions& options) {
  std::fprintf(stderr, "listening at %s …\n", address.c_str());
  const auto found = recognise(address, options.allow_remote);
  if (!found) return Unexpected<SetupError>(found.error());
  std::printf("received: %s\n", found->received.c_str());
  const auto reading = choose_reading(*found, options.yes);
  if (!reading) return Unexpected<SetupError>(reading.error());
  std::printf("read as: %s\n", reading->meaning.c_str());
  if (found->baud != 0) std::printf("baud rate: %d\n", found->baud);
  return found->uri(*reading);
}

struct Measurement {
  ProbeInfo info;
  std::optional<SampleTiming> timing = {};
  std::optional<DeviceCounts> counts = {};
  ProbeSample last = {};
  std::vector<FoundChannel> channels = {};
  std::optional<RestDrift> drift = {};           ///< measured on request
  std::optional<ProbeCalibration> at_skin = {};  ///< in which the skin is depth 0

  /// Several channels, which are not force and depth of one probe.
  [[nodiscard]] bool is_hand() const {
    const auto presses = [](const FoundChannel& channel) {
      return !channel.name.ends_with("_kPa");
    };
    return std::count_if(channels.begin(), channels.end(), presses) > 1 &&
           !std::ranges::all_of(info.extra_columns, is_sync_name);
  }
  [[nodiscard]] bool is_array() const { return info.taxels > 0; }
};

struct ChannelValue {
  std::string name;
  double value = 0.0;
};

/// The channels of a probe that are forces or depths, with their values in a sample.
/// \param further  values of its further columns
std::vector<ChannelValue> values_of(const ProbeInfo& info, const ProbeSample& sample,
                                    std::span<const double> further) {
  std::vector<ChannelValue> values;
  if ((info.channels & ProbeSample::kForce) != 0U) {
    values.push_back({.name = "force_N", .value = units::N_from_mN(sample.force_mN)});
  }
  if ((info.channels & ProbeSample::kDepth) != 0U) {
    values.push_back({.name = "depth_mm", .value = sample.depth_mm});
  }
  for (std::size_t i = 0; i < info.extra_columns.size(); ++i) {
    if (is_sync_name(info.extra_columns[i])) continue;
    values.push_back({.name = info.extra_columns[i], .value = further[i]});
  }
  return values;
}

/// Opens a device; a tactile array, by the names of its channels, as an array.
Expected<std::unique_ptr<Probe>, SetupError> open_found(const std::string& uri, bool allow_remote) {
  const auto open_array = [&](std::size_t taxels) {
    return open_probe(uri + "#taxels=" + std::to_string(taxels), allow_remote);
  };
  if (const std::size_t taxels = taxels_among(channels_of(uri)); taxels > 0) {
    return open_array(taxels);
  }
  auto probe = open_probe(uri, allow_remote);
  if (!probe) return probe;
  const ProbeInfo& info = (*probe)->info();
  std::vector<std::string> channels = info.device_channels;
  if ((info.channels & ProbeSample::kForce) != 0U) channels.emplace_back("force_N");
  if ((info.channels & ProbeSample::kDepth) != 0U) channels.emplace_back("depth_mm");
  const std::size_t taxels = taxels_among(channels);
  if (taxels == 0) return probe;
  probe->reset();  // frees the port
  return open_array(taxels);
}

/// Waits until a probe is lowered onto the skin. \return the calibration of its depth that is 0
/// there
Expected<ProbeCalibration, SetupError> find_skin(Probe& probe, double seconds) {
  constexpr std::chrono::milliseconds kOften{100};
  constexpr std::uint32_t kBoth = ProbeSample::kDepth | ProbeSample::kForce;
  const ProbeCalibration* const present = probe.status().calibration;
  if (present == nullptr || (probe.info().channels & kBoth) != kBoth) {
    return bad_input("--skin-s needs one device that measures force and depth");
  }
  std::atomic<bool> stopped{false};
  const StopSignal stop(stopped);
  std::fprintf(stderr, "lower the probe onto the skin, slowly; Ctrl-C gives up …\n");
  std::vector<double> depth_mm;
  std::vector<double> force_N;
  std::optional<double> skin_mm;
  Readings readings = probe.readings();
  auto end = std::chrono::steady_clock::now() + units::nanoseconds_from_s(seconds);
  auto next = std::chrono::steady_clock::now() + kOften;
  while (!stopped && std::chrono::steady_clock::now() < end) {
    const auto count = probe.read(readings, std::chrono::milliseconds{50});
    if (!count) return unavailable(probe.error_message());
    for (const std::string& sentence : probe.take_notices()) warn(sentence);
    for (std::size_t i = 0; i < *count; ++i) {
      const auto sample = readings.sample(i);
      if (!sample) continue;
      depth_mm.push_back(sample->depth_mm);
      force_N.push_back(units::N_from_mN(sample->force_mN));
    }
    if (std::chrono::steady_clock::now() < next) continue;
    next += kOften;
    const bool found = skin_mm.has_value();
    skin_mm = skin_depth_mm(depth_mm, force_N);
    // A little more of the press makes it exact.
    if (skin_mm && !found) end = std::min(end, next + 3 * kOften);
  }
  if (!skin_mm) {
    return unavailable(
        "the force never left its noise while the depth increased: begin above the skin, lower the "
        "probe onto it, or wait longer with --skin-s");
  }
  ProbeCalibration calibration{.serial_number = probe.info().serial_number};
  ChannelCalibration depth = *present->channels[0];
  depth.zero += *skin_mm / depth.gain;
  std::printf("skin: the force leaves the noise at a depth of %.4g mm, which is depth 0\n",
              *skin_mm);
  calibration.channels[0] = depth;
  return calibration;
}

Expected<Measurement, SetupError> measure(const std::string& uri, const ConnectOptions& options) {
  auto probe = open_found(uri, options.allow_remote);
  if (!probe) return Unexpected<SetupError>(probe.error());
  if ((*probe)->info().replayed) {
    return bad_input("\"" + uri +
                     "\" is a recording or simulation: there is nothing to connect to");
  }
  Measurement measured{.info = (*probe)->info()};
  Readings readings = (*probe)->readings();
  std::vector<std::vector<double>> values;  // by channel
  const std::vector<double> none(measured.info.extra_columns.size());
  for (const ChannelValue& each : values_of(measured.info, {}, none)) {
    measured.channels.push_back({.name = each.name});
  }
  values.resize(measured.channels.size());
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds{6};
  while (!measured.timing && std::chrono::steady_clock::now() < end) {
    const auto count = (*probe)->read(readings, std::chrono::milliseconds{50});
    if (!count) return unavailable((*probe)->error_message());
    for (std::size_t i = 0; i < *count; ++i) {
      measured.last = readings.sample(i).value_or(measured.last);
      const std::vector<ChannelValue> now =
          values_of(measured.info, measured.last, readings.further(i));
      for (std::size_t k = 0; k < now.size(); ++k) {
        if (std::isfinite(now[k].value)) values[k].push_back(now[k].value);
      }
    }
    measured.timing = (*probe)->timing();
    for (const std::string& sentence : (*probe)->take_notices()) warn(sentence);
  }
  measured.counts = (*probe)->device_counts();
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!values[k].empty()) measured.channels[k].last = values[k].back();
    measured.channels[k].noise = noise_at_rest(values[k]);
  }
  if (!measured.timing) return unavailable(uri + " sent too few samples to measure its rate");
  if (options.rest_s > 0.0) {
    const auto drift = measure_rest(**probe, options.rest_s);
    if (!drift) return Unexpected<SetupError>(drift.error());
    measured.drift = *drift;
  }
  if (options.skin_s > 0.0) {
    auto at_skin = find_skin(**probe, options.skin_s);
    if (!at_skin) return Unexpected<SetupError>(at_skin.error());
    measured.at_skin = std::move(*at_skin);
  }
  return measured;
}

void print(const Measurement& measured) {
  const ProbeSample& last = measured.last;
  std::printf("measures:");
  for (const FoundChannel& channel : measured.channels) {
    const auto mark = channel.name.rfind('_');
    const std::string unit = channel.name.substr(mark + 1);
    const std::string value = channel.last ? printed("%.4g ", *channel.last) + unit : "no value";
    std::printf(" %s %s", channel.name.substr(0, mark).c_str(), value.c_str());
  }
  if (last.has(ProbeSample::kX)) std::printf(" x %.4g mm", last.x_mm);
  if (last.has(ProbeSample::kY)) std::printf(" y %.4g mm", last.y_mm);
  if (measured.is_array()) {
    const ArrayLayout layout = ArrayLayout::of(measured.info.taxels, measured.info.uri);
    std::printf(" in all\narray: %zu taxels in each reading, taken as %zu x %zu",
                measured.info.taxels, layout.columns, layout.rows);
  }
  if (measured.is_hand()) std::printf("\nchannels: %zu in each reading", measured.channels.size());
  std::printf("\n%s", filled_text("timing", timing_json(*measured.timing)).c_str());
  if (measured.counts) {
    std::fputs(filled_text("device", device_json(measured.counts)).c_str(), stdout);
  }
  if (measured.drift) {
    const bool force = (measured.info.channels & ProbeSample::kForce) != 0U;
    std::printf("%s\n", drift_text(*measured.drift, force).c_str());
  }
}

/// The file beside a scene in which the depth is calibrated.
std::string skin_file(const std::string& scene) {
  return std::filesystem::path(scene).replace_extension(".gauge.toml").string();
}

/// Writes where the skin is. \return the URI with that calibration
Expected<std::string, SetupError> with_skin(const std::string& uri,
                                            const ProbeCalibration& calibration,
                                            const ConnectOptions& options) {
  const std::string path = skin_file(options.out);
  auto file = OutputFile::create(path, options.overwrite);
  if (!file) return Unexpected<SetupError>(file.error());
  if (!file->write(calibration_text(calibration, "merkel connect: depth 0 is the skin")) ||
      !file->close()) {
    return unavailable(file->error());
  }
  return uri + (uri.find('?') == std::string::npos ? "?" : "&") + "calibration=" + path;
}

/// Lists what would improve a run with this device.
std::vector<std::string> missing(const Measurement& measured, const std::string& uri) {
  std::vector<std::string> list;
  if (measured.is_array()) {
    list.emplace_back(
        "the layout: the columns, rows, pitch and size of the taxels are a guess, and so is their "
        "unit if the device does not state it (columns=taxel_Pa*" +
        std::to_string(measured.info.taxels) + ")");
  }
  if (measured.info.calibration_file.empty() && !measured.is_hand() && !measured.is_array()) {
    const bool force = (measured.info.channels & ProbeSample::kForce) != 0U;
    list.push_back("a calibration: merkel calibrate '" + uri + "' gauge.toml --points 0,0.5,1" +
                   (force ? "" : " --channel depth"));
  }
  for (const ProtocolEntry& entry : protocol_table()) {
    const std::string guess(entry.options);
    if (guess.empty() || uri.find(guess) == std::string::npos) continue;
    list.push_back("the scale: " + guess + " is a guess; take it from the device's data sheet");
  }
  if (uri.ends_with(kGuessedCard)) {
    list.emplace_back(
        "what the card measures: channel 0 is taken as a force of 1 N per V; set channels, columns and "
        "force_N_per_V, and position_mm_per_V for a position");
  }
  for (const FoundChannel& channel : measured.channels) {
    if (!measured.is_array() && !channel.last) {
      list.push_back("values of " + channel.name +
                     ": it had none; check its sensor and its wiring, and connect again");
    }
    if (measured.is_array() || !channel.is_force() || channel.noise || !channel.last) continue;
    list.push_back("the key contact_N, above the noise: " + channel.name +
                   " was never within 0.1 N of 0; connect again while nothing touches it, and if "
                   "that does not help, calibrate its zero");
  }
  if (!measured.is_hand() && (measured.info.channels & (ProbeSample::kX | ProbeSample::kY)) == 0U) {
    list.emplace_back(
        "the position of the press: the patch's centre is assumed; set x_mm and y_mm");
  }
  if (!measured.counts || !measured.counts->device_clock) {
    list.emplace_back(
        "a device clock: samples are timed by their arrival, or by the midpoint of request and reply");
  }
  return list;
}

/// The preset for a device, and why.
struct ChosenModel {
  std::string preset;
  std::string why;
};

ChosenModel model_for(const ProbeInfo& info) {
  if ((info.channels & ProbeSample::kForce) != 0U) {
    return {"goodwin",
            "the device measures force, and these afferents are fitted to recordings "
            "under known forces"};
  }
  return {"finger",
          "the device measures depth only, and this skin is as soft as a finger's, so "
          "that a depth gives a finger's force"};
}

std::string scene_text(const std::string& uri, const ChosenModel& model, const std::string& contact,
                       const std::vector<std::string>& lacking) {
  std::string text = "# Written by merkel connect.\npreset = " + toml_string(model.preset) +
                     "  # " + model.why + "\n\n[probe]\nuri = " + toml_string(uri) +
                     "\ntip = \"sphere\"\nradius_mm = 2.0  # set the radius of your probe's tip\n" +
                     contact;
  for (const std::string& line : lacking) text += "# missing: " + line + "\n";
  return text;
}

/// The device reads its calibration only once it is reached: too late for a question about --out.
void note_calibration(const std::string& address) {
  const auto uri = Uri::parse(address);
  if (!uri) return;
  const auto calibration = uri->options.find("calibration");
  if (calibration != uri->options.end()) ReadFiles::note(calibration->second);
}

int connect(const ConnectOptions& options) {
  note_calibration(options.target);
  if (const auto free = check_writable(options.out, options.overwrite); !free) {
    return refuse(free.error().sentence + " with --out");
  }
  const auto address = address_of(options);
  if (!address) return refuse(address.error());
  Expected<std::string, SetupError> uri = *address;
  if (address->find("protocol=") == std::string::npos && !address->starts_with("fused:") &&
      !address->starts_with("hid:") && !address->starts_with("lsl:") &&
      !address->starts_with("comedi:")) {
    uri = recognised(*address, options);
  }
  if (address->starts_with("comedi:") && address->find("columns=") == std::string::npos) {
    uri = *address + (address->find('?') == std::string::npos ? "?" : "&") +
          std::string(kGuessedCard);
  }
  if (!uri) return refuse(uri.error());
  if (options.skin_s > 0.0 && uri->find("calibration=") != std::string::npos) {
    return refuse("--skin-s writes a calibration of its own: remove calibration=… from the URI");
  }
  const auto measured = measure(*uri, options);
  if (!measured) return refuse(measured.error());
  print(*measured);
  if (measured->at_skin) {
    uri = with_skin(*uri, *measured->at_skin, options);
    if (!uri) return refuse(uri.error());
  }
  const std::vector<std::string> lacking = missing(*measured, *uri);
  for (const std::string& line : lacking) std::printf("missing: %s\n", line.c_str());

  std::string text;
  if (measured->is_array()) {
    std::printf(
        "model: the preset goodwin: its afferents are driven by the energy density, which "
        "the pressures of an array give\n");
    text = array_scene_text(*uri, measured->info.taxels, lacking);
  } else if (measured->is_hand()) {
    const std::vector<PlacedChannel> placed = place_on_hand(measured->channels);
    for (const PlacedChannel& each : placed) {
      std::printf("probe: %s on the patch %s%s\n", each.channel.name.c_str(), each.patch.c_str(),
                  each.by_name ? "" : ", by its place in the line: set it in the scene");
    }
    text = hand_scene_text(*uri, placed, lacking);
  } else {
    const ChosenModel model = model_for(measured->info);
    std::printf("model: the preset %s: %s\n", model.preset.c_str(), model.why.c_str());
    std::string contact;
    for (const FoundChannel& channel : measured->channels) contact += contact_line(channel);
    if (measured->drift && contact.find("zero = ") != std::string::npos) {
      contact += drift_line(*measured->drift);
    }
    text = scene_text(*uri, model, contact, lacking);
  }
  if (const auto scene = parse_scene(text, options.out); !scene) return refuse(scene.error());
  auto file = OutputFile::create(options.out, options.overwrite);
  if (!file) return refuse(file.error());
  if (!file->write(text) || !file->close()) return fail(file->error());
  std::printf("wrote %s: run it with\n  merkel run %s%s\n", options.out.c_str(),
              options.out.c_str(), options.allow_remote ? " --allow-remote" : "");
  return kDone;
}

}  // namespace

void add_connect_command(CommandLine& program) {
  auto options = std::make_shared<ConnectOptions>();
  program
      .subcommand("connect",
                  "Finds a device or waits for one, recognises its protocol, baud rate, columns "
                  "and units, measures its rate, jitter and clock, lists what is missing, and "
                  "writes a scene file that merkel run accepts as it is.",
                  "connect /dev/ttyUSB0 --out gauge.toml")
      .option(
          "target", options->target,
          "Port (/dev/ttyUSB0), address (tcp:HOST:PORT, udp:HOST:PORT, comedi:/dev/comedi0) or whole probe URI; "
          "default: the first serial device")
      .option("--out", options->out, "Scene file to write; default connected.toml")
      .option("--wait-s", options->wait_s, "How long to wait for a device or for PORT, s",
              {0, 86'400})
      .option("--rest-s", options->rest_s,
              "Measure the drift while nothing touches, for so long or until Ctrl-C, s",
              {0, 86'400})
      .option("--skin-s", options->skin_s,
              "Wait so long until the probe is lowered onto the skin, which becomes depth 0, s",
              {0, 3600})
      .flag("--yes", options->yes,
            "Do not ask: take the likeliest interpretation, if the units are stated")
      .flag("--overwrite", options->overwrite, "Replace an existing file")
      .flag("--allow-remote", options->allow_remote, kRemoteProbesHelp)
      .runs([options] { return connect(*options); });
}

}  // namespace merkel
