#include "drivers/probes/open_probe.hpp"

#include <algorithm>
#include <utility>

#include "drivers/lsl_library.hpp"
#include "drivers/probes/fused_probe.hpp"
#include "drivers/probes/live_probe.hpp"
#include "drivers/probes/measured_probe.hpp"
#include "drivers/probes/open_device.hpp"
#include "drivers/probes/pad_probe.hpp"
#include "drivers/probes/recorded_outputs.hpp"
#include "drivers/probes/repeated_probe.hpp"
#include "drivers/probes/replay_probe.hpp"
#include "drivers/probes/sim_probe.hpp"
#include "drivers/sessions/rig_recording.hpp"
#include "drivers/uri.hpp"

namespace merkel {
namespace {

/// The recording itself, as often as the option repeat says, or, with live=1, a probe that plays it
/// like a device.
Expected<std::unique_ptr<Probe>, SetupError> played(
    const Uri& uri, Expected<std::unique_ptr<Probe>, SetupError> (*open)(const Uri&)) {
  Uri recording = uri;
  Uri pace = uri;
  pace.options.clear();
  for (const char* key : {"live", "repeat"}) {
    if (auto option = recording.options.extract(key)) pace.options.insert(std::move(option));
  }
  UriOptions options(pace);
  const bool live = options.whole("live", 0, 0, 1) == 1;
  const std::int64_t rounds = options.whole("repeat", 1, 0, 1'000'000'000);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  auto probe = open(recording);
  if (!probe) return probe;
  if (rounds != 1) {
    probe = std::make_unique<RepeatedProbe>(
        std::move(*probe), [recording, open] { return open(recording); },
        static_cast<std::uint64_t>(rounds));
  }
  if (!live) return probe;
  return std::make_unique<LiveProbe>(std::move(*probe));
}

/// A recording or a simulated press: one or several probes are fed by its columns.
Expected<std::unique_ptr<Probe>, SetupError> recorded(
    const Uri& uri, Expected<std::unique_ptr<Probe>, SetupError> (*open)(const Uri&)) {
  if (std::any_of(uri.calibrations.begin(), uri.calibrations.end(),
                  [](const std::string& file) { return !file.empty(); })) {
    return bad_input(
        "\"" + uri.text +
        "\": a recording or simulation has no calibration: remove the key calibration");
  }
  auto probe = played(uri, open);
  if (!probe) return probe;
  return RecordedOutputs::split(std::move(*probe), uri.parts);
}

Expected<std::unique_ptr<Probe>, SetupError> open_any(std::string_view text,
                                                      const DeviceUri& device) {
  if (text.starts_with("fused:")) return FusedProbe::open(text);
  if (text.starts_with("/dev/")) {
    const std::string port(text);
    return bad_input("\"" + port + "\" is a port, not a probe URI: merkel connect " + port +
                     " recognises the device at it and writes its URI into a scene");
  }
  auto uri = Uri::parse(text);
  if (!uri) return Unexpected<SetupError>(uri.error());
  uri->parts = device.parts;
  uri->calibrations = device.calibrations;
  if (uri->scheme == "replay") return recorded(*uri, ReplayProbe::open);
  if (uri->scheme == "sim") {
    return recorded(*uri, uri->path == "pad" ? PadProbe::open : SimProbe::open);
  }
  if (uri->scheme == "serial") return open_serial_device(*uri);
  if (uri->scheme == "udp" || uri->scheme == "tcp") return open_network_device(*uri);
  if (uri->scheme == "hid") return open_hid_device(*uri);
  if (uri->scheme == "usb") return open_usb_device(*uri);
  if (uri->scheme == "redis") {
#ifdef MERKEL_WITH_HIREDIS
    return open_redis_device(*uri);
#else
    return bad_input("\"" + uri->text +
                     "\": this merkel was built without hiredis: install libhiredis-dev, then "
                     "configure and build merkel again");
#endif
  }
  if (uri->scheme == "lsl") {
#ifdef MERKEL_WITH_LSL
    return open_lsl_device(*uri);
#else
    return bad_input("\"" + uri->text + "\": this merkel was built without " +
                     std::string(kLslLibrary) + ", then configure and build merkel again");
#endif
  }
  return bad_input(
      "\"" + uri->text + "\": there is no probe scheme \"" + uri->scheme +
      "\"; the known ones are replay:FILE, sim:SHAPE, serial:DEVICE?protocol=NAME, hid:VID:PID, "
      "usb:VID:PID, udp:HOST:PORT?protocol=NAME, tcp:HOST:PORT?protocol=NAME, lsl:NAME, "
      "redis:HOST:PORT?stream=NAME and fused:URI|URI");
}

}  // namespace

Expected<std::unique_ptr<Probe>, SetupError> open_device(const DeviceUri& device) {
  auto probe = open_any(device.uri, device);
  if (!probe || (*probe)->info().replayed) return probe;
  return std::make_unique<MeasuredProbe>(std::move(*probe));
}

Expected<std::unique_ptr<Probe>, SetupError> open_probe(std::string_view text) {
  return open_device(DeviceUri::split(text));
}

std::vector<std::string> files_of_probe(std::string_view text) {
  const auto uri = Uri::parse(DeviceUri::split(text).uri);
  if (!uri) return {};
  std::vector<std::string> files;
  if (uri->scheme == "replay") files.push_back(split_rig(uri->path).first);
  if (const auto calibration = uri->options.find("calibration");
      calibration != uri->options.end()) {
    files.push_back(calibration->second);
  }
  if (uri->scheme != "fused") return files;
  std::string_view members = text.substr(text.find(':') + 1);
  while (!members.empty()) {
    const std::string_view member = members.substr(0, members.find('|'));
    for (std::string& file : files_of_probe(member)) files.push_back(std::move(file));
    members.remove_prefix(std::min(member.size() + 1, members.size()));
  }
  return files;
}

}  // namespace merkel
