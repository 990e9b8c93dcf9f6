// Compiled only if hiredis is found.
#include <string>
#include <utility>

#include "drivers/probes/device_probe.hpp"
#include "drivers/probes/open_device.hpp"
#include "drivers/protocols/protocol_makers.hpp"
#include "drivers/transports/redis_port.hpp"

namespace merkel {

Expected<std::unique_ptr<Probe>, SetupError> open_redis_device(const Uri& uri,
                                                               const DeviceUri& device) {
  Uri lines = uri;  // with the options of the protocol csv
  const auto stream = lines.options.extract("stream");
  const auto named = lines.options.extract("fields");
  const auto rule = lines.options.find("clock");
  if (stream.empty() || stream.mapped().empty()) {
    return bad_input("\"" + uri.text +
                     "\": name the stream, for example redis:127.0.0.1:6379?stream=gauge");
  }
  if (lines.options.contains("columns")) {
    return bad_input("\"" + uri.text + "\": use the option fields instead of columns");
  }
  auto fields = parse_redis_fields(named.empty() ? "" : named.mapped());
  if (!fields) return bad_input("\"" + uri.text + "\": " + fields.error());
  UriOptions given(lines);
  const auto factors = UnitFactors::from(given);
  if (!factors) return Unexpected<SetupError>(factors.error());
  auto entries = open_redis_stream(uri, stream.mapped(), std::move(*fields), *factors);
  if (!entries) return Unexpected<SetupError>(entries.error());
  const bool ruled = rule != lines.options.end();
  lines.options.emplace("columns", entries->columns);
  UriOptions options(lines);
  DeviceProbe::Settings settings = DeviceProbe::settings_from(options, uri, device);
  // A node of this machine stamps its entries with the host's clock.
  if (!ruled || settings.times == ReadingTimes::Rule::kDevice) {
    settings.times = ReadingTimes::Rule::kHost;
  }
  auto protocol = make_csv_lines(options);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (!protocol) return bad_input("\"" + uri.text + "\": " + protocol.error().sentence);
  settings.protocol = "redis";
  settings.hint = "that its node is running, and the option fields";
  return DeviceProbe::open(std::move(entries->port), std::move(*protocol), std::move(settings));
}

}  // namespace merkel
