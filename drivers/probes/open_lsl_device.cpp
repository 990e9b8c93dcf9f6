// Compiled only if liblsl is found.
#include <string>
#include <utility>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "drivers/probes/device_probe.hpp"
#include "drivers/probes/open_device.hpp"
#include "drivers/protocols/csv_text_style.hpp"
#include "drivers/protocols/protocol_makers.hpp"
#include "drivers/transports/lsl_port.hpp"

namespace merkel {
namespace {

/// The columns of the port's lines, in the form of the csv option `columns`, by the labels and
/// units of the channels ("force", "N"). A channel that measures something else is "-". Several
/// channels of a unit have the names of their labels: "thumb_N".
std::string columns_of(const LslStream& stream, const UnitFactors& factors) {
  std::vector<std::string> names;
  std::vector<CsvField> labels;
  for (const LslStream::Channel& channel : stream.channels) {
    labels.push_back({.label = channel.label, .number = {}, .unit = channel.unit});
    std::string name = csv_column_of(labels.back());
    if (name == "-") name = csv_own_name_of(labels.back(), factors);
    const bool measures = !name.empty() && name != "seq" && !name.starts_with("time");
    names.push_back(measures ? name : "-");
  }
  tell_csv_columns_apart(names, labels, factors);
  std::string columns = "time_s";
  for (const std::string& name : names) columns += "," + name;
  return columns;
}

}  // namespace

Expected<std::unique_ptr<Probe>, SetupError> open_lsl_device(const Uri& uri,
                                                             const DeviceUri& device) {
  if (uri.path.empty()) {
    return bad_input("\"" + uri.text + "\": name the stream, for example lsl:Gauge");
  }
  Uri lines = uri;  // with the options of the protocol csv
  const auto host = lines.options.extract("host");
  auto stream = open_lsl_stream(uri.path, host.empty() ? "" : host.mapped());
  if (!stream) return Unexpected<SetupError>(stream.error());
  // The user's options take precedence over the stream's description.
  const auto columns = lines.options.find("columns");
  if (columns != lines.options.end()) {
    columns->second.insert(0, "time_s,");
  } else {
    UriOptions factor_options(uri);
    const auto factors = UnitFactors::from(factor_options);
    lines.options.emplace("columns", columns_of(*stream, factors.value_or(UnitFactors{})));
  }
  if (stream->rate_Hz > 0.0) {
    lines.options.try_emplace("rate_hz", shortest_decimal(stream->rate_Hz));
  }
  UriOptions options(lines);
  DeviceProbe::Settings settings = DeviceProbe::settings_from(options, uri, device);
  // LSL stamps are on this machine's clock already, if need be by LSL's own offset.
  const auto rule = uri.options.find("clock");
  if (rule == uri.options.end() || settings.times == ReadingTimes::Rule::kDevice) {
    settings.times = ReadingTimes::Rule::kHost;
  }
  auto protocol = make_csv_lines(options);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  const bool lacks_factor = !protocol && !UnitFactors::key_in(protocol.error().sentence).empty();
  if (!protocol && (lacks_factor || uri.options.contains("columns"))) {
    return bad_input("\"" + uri.text + "\": " + protocol.error().sentence);
  }
  if (!protocol) {
    return bad_input("\"" + uri.text +
                     "\": no channel label names a force, a depth or a position: name the "
                     "channels, for example columns=force_N,-");
  }
  settings.protocol = "lsl";
  settings.hint = "that its outlet is sending, and the option columns";
  return DeviceProbe::open(std::move(stream->port), std::move(*protocol), std::move(settings));
}

}  // namespace merkel
