#include "drivers/probes/open_device.hpp"

#include <string>
#include <utility>

#include "drivers/probes/device_probe.hpp"
#include "drivers/protocols/protocol_table.hpp"
#include "drivers/transports/serial_port.hpp"

namespace merkel {
namespace {

/// A sentence about an option, with the URI before it.
Unexpected<SetupError> about(const Uri& uri, const SetupError& error) {
  return Unexpected<SetupError>(
      SetupError{.kind = error.kind, .sentence = "\"" + uri.text + "\": " + error.sentence});
}

}  // namespace

Expected<std::unique_ptr<Probe>, SetupError> open_serial_device(const Uri& uri) {
  UriOptions options(uri);
  const auto entry = find_protocol(options.text("protocol", ""));
  if (!entry) return about(uri, entry.error());
  const auto baud = options.whole("baud", (*entry)->baud, 50, 12'000'000);
  DeviceProbe::Settings settings = DeviceProbe::settings_from(options, uri);
  auto protocol = (*entry)->make(options);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (!protocol) return about(uri, protocol.error());
  if (uri.path.empty()) {
    return bad_input("\"" + uri.text +
                     "\" names no device: write for example serial:/dev/ttyUSB0?protocol=hbf1");
  }
  settings.protocol = (*entry)->name;
  settings.hint = "the baud rate (it is read at " + std::to_string(baud) + " Bd; " +
                  settings.protocol + " mostly runs at " + std::to_string((*entry)->baud) +
                  ") and the cable";
  auto port = open_serial({.device = uri.path, .baud = static_cast<int>(baud)});
  if (!port) return Unexpected<SetupError>(port.error());
  return DeviceProbe::open(std::move(*port), std::move(*protocol), std::move(settings));
}

}  // namespace merkel
