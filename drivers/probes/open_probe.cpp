#include "drivers/probes/open_probe.hpp"

#include <algorithm>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "drivers/calibration/probe_calibration.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/files/example_file.hpp"
#include "drivers/lsl_library.hpp"
#include "drivers/probes/fused_probe.hpp"
#include "drivers/probes/measured_probe.hpp"
#include "drivers/probes/open_device.hpp"
#include "drivers/probes/played_probe.hpp"
#include "drivers/probes/recorded_outputs.hpp"
#include "drivers/probes/replay_probe.hpp"
#include "drivers/probes/sim_probe.hpp"
#include "drivers/protocols/device_units.hpp"
#include "drivers/protocols/hid_fields.hpp"
#include "drivers/protocols/protocol_table.hpp"
#include "drivers/protocols/unit_factors.hpp"
#include "drivers/uri.hpp"

namespace merkel {
namespace {

/// The calibration files of its probes; empty: none.
std::vector<std::string> calibrations_of(const Uri& uri, const DeviceUri& device) {
  std::vector<std::string> files = device.calibrations;
  if (std::all_of(files.begin(), files.end(), [](const auto& file) { return file.empty(); })) {
    files.clear();
  }
  const auto option = uri.options.find("calibration");
  if (option != uri.options.end() && !option->second.empty()) files.push_back(option->second);
  return files;
}

/// The factors in calibration files count as options of the URI.
Expected<void, SetupError> add_unit_factors(Uri& uri, const DeviceUri& device) {
  for (const std::string& file : calibrations_of(uri, device)) {
    if (file.empty()) continue;
    const auto calibration = read_calibration(file);
    if (!calibration) return Unexpected<SetupError>(calibration.error());
    for (const auto& [key, factor] : calibration->factors) {
      const auto [option, added] = uri.options.emplace(key, shortest_decimal(factor));
      if (added || parse_number(option->second) == factor) continue;
      return bad_input("\"" + uri.text + "\": the calibration " + file + " has another " + key +
                       ": keep one");
    }
  }
  return {};
}

/// A recording or a simulated press: one or several probes are fed by its columns.
Expected<std::unique_ptr<Probe>, SetupError> recorded(
    const Uri& uri, const DeviceUri& device,
    Expected<std::unique_ptr<Probe>, SetupError> (*open)(const Uri&)) {
  Uri recording = uri;
  const auto given = recording.options.extract("calibration");
  std::vector<std::string> files = calibrations_of(uri, device);
  const bool in_units =
      std::none_of(recording.options.begin(), recording.options.end(),
                   [](const auto& each) { return UnitFactors::is_key(each.first); });
  if (!files.empty() && in_units) {
    return bad_input(
        "\"" + uri.text +
        "\": a simulation or a recording in N and mm has no calibration: remove it; the calibration "
        "of a trace in volts or counts has a key such as force_N_per_V");
  }
  auto probe = play(recording, open);
  if (!probe) return probe;
  return RecordedOutputs::split(std::move(*probe), device.parts, std::move(files));
}

struct DeviceScheme {
  std::string_view name;
  OpenDevice* open;              ///< null if the library is missing
  std::string_view remedy = {};  ///< how to get the library
};
constexpr DeviceScheme kDeviceSchemes[] = {
    {"serial", open_serial_device},
    {"udp", open_network_device},
    {"tcp", open_network_device},
    {"hid", open_hid_device},
    {"usb", open_usb_device},
    {"comedi", MERKEL_WITH_COMEDI ? open_comedi_device : nullptr,
     "comedilib: install libcomedi-dev"},
    {"redis", MERKEL_WITH_HIREDIS ? open_redis_device : nullptr, "hiredis: install libhiredis-dev"},
    {"lsl", MERKEL_WITH_LSL ? open_lsl_device : nullptr, kLslLibrary},
};

Expected<std::unique_ptr<Probe>, SetupError> open_any(const DeviceUri& device) {
  const std::string& text = device.uri;
  if (text.starts_with("fused:")) return FusedProbe::open(text, device.allow_remote);
  if (text.starts_with("/dev/")) {
    return bad_input("\"" + text + "\" is a port, not a probe URI: merkel connect " + text +
                     " recognises the device at it and writes its URI into a scene");
  }
  auto uri = Uri::parse(text);
  if (!uri) return Unexpected<SetupError>(uri.error());
  if (auto added = add_unit_factors(*uri, device); !added) {
    return Unexpected<SetupError>(added.error());
  }
  if (uri->scheme == "replay") {
    uri->path = path_or_example(Example::kTrace, uri->path);
    return recorded(*uri, device, ReplayProbe::open);
  }
  if (uri->scheme == "sim") {
    return recorded(*uri, device, SimProbe::open);
  }
  for (const DeviceScheme& scheme : kDeviceSchemes) {
    if (uri->scheme != scheme.name) continue;
    if (scheme.open != nullptr) return scheme.open(*uri, device);
    return bad_input("\"" + uri->text + "\": this merkel was built without " +
                     std::string(scheme.remedy) + ", then configure and build merkel again");
  }
  return bad_input(
      "\"" + uri->text + "\": there is no probe scheme \"" + uri->scheme +
      "\"; the known ones are replay:FILE, sim:SHAPE, serial:DEVICE?protocol=NAME, hid:VID:PID, "
      "usb:VID:PID, udp:HOST:PORT?protocol=NAME, tcp:HOST:PORT?protocol=NAME, lsl:NAME, "
      "comedi:/dev/comedi0?columns=force_V, redis:HOST:PORT?stream=NAME and fused:URI|URI");
}

/// The channels of a device that its URI names; empty: only the device knows.
std::vector<ChannelName> stated_names(const DeviceUri& device) {
  auto uri = Uri::parse(device.uri);
  if (!uri || uri->scheme == "fused" || !add_unit_factors(*uri, device)) return {};
  UriOptions options(*uri);
  if (uri->scheme == "hid") {
    auto map = read_hid_fields(options);
    if (!map || map->fields.empty()) return {};
    return make_hid_fields(std::move(*map))->channel_names();
  }
  // Without a protocol, columns are those of csv (lsl, comedi).
  const auto entry = find_protocol(options.text("protocol", "csv"));
  if (!entry) return {};
  const auto protocol = (*entry)->make(options);
  return protocol ? (*protocol)->channel_names() : std::vector<ChannelName>{};
}

}  // namespace

std::uint32_t stated_channels(const DeviceUri& device) {
  const ChannelSelection selection =
      device.parts.empty() ? ChannelSelection{} : device.parts.front();
  if (const auto chosen = selection.among(stated_names(device)); chosen) {
    return chosen->sample_channels();
  }
  // The selection names channels that only the device knows.
  std::uint32_t channels = 0;
  for (std::size_t i = 0; i < selection.of.size(); ++i) {
    if (!selection.of[i].empty()) channels |= 1U << i;
  }
  for (const std::string& name : selection.by_unit) {
    const auto unit = unit_named(name.substr(name.rfind('_') + 1));
    if (!unit) return 0;
    channels |= unit->quantity == Quantity::kForce ? ProbeSample::kForce : ProbeSample::kDepth;
  }
  return channels;
}

Expected<std::unique_ptr<Probe>, SetupError> open_device(const DeviceUri& device) {
  auto probe = open_any(device);
  if (!probe || (*probe)->info().replayed) return probe;
  return std::make_unique<MeasuredProbe>(std::move(*probe));
}

Expected<std::unique_ptr<Probe>, SetupError> open_probe(std::string_view text, bool allow_remote) {
  auto device = DeviceUri::parse(text);
  if (!device) return Unexpected<SetupError>(device.error());
  device->allow_remote = allow_remote;
  return open_device(*device);
}

}  // namespace merkel
