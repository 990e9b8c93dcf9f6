#include "drivers/probes/open_device.hpp"

#include <string>
#include <utility>

#include "drivers/probes/device_probe.hpp"
#include "drivers/protocols/hid_fields.hpp"
#include "drivers/protocols/hid_report_descriptor.hpp"
#include "drivers/protocols/protocol_makers.hpp"
#include "drivers/protocols/protocol_table.hpp"
#include "drivers/transports/hid_port.hpp"
#include "drivers/transports/network_port.hpp"
#include "drivers/transports/serial_port.hpp"
#include "drivers/transports/usb_port.hpp"

namespace merkel {
namespace {

/// An error about an option, preceded by the URI.
Unexpected<SetupError> about(const Uri& uri, const SetupError& error) {
  return Unexpected<SetupError>(
      SetupError{.kind = error.kind, .sentence = "\"" + uri.text + "\": " + error.sentence});
}

/// The protocol that the options name. Without one, the device can be recognised.
Expected<const ProtocolEntry*, SetupError> protocol_of(const Uri& uri, UriOptions& options) {
  auto entry = find_protocol(options.text("protocol", ""));
  if (entry) return entry;
  auto error = about(uri, entry.error());
  if (!options.given("protocol") && !uri.path.empty()) {
    error.value().sentence += "; or let merkel connect " + uri.scheme + ":" + uri.path +
                              " recognise the device and write a scene for it";
  }
  return error;
}

}  // namespace

Expected<std::unique_ptr<Probe>, SetupError> open_serial_device(const Uri& uri,
                                                                const DeviceUri& device) {
  UriOptions options(uri);
  const auto entry = protocol_of(uri, options);
  if (!entry) return Unexpected<SetupError>(entry.error());
  const auto baud = options.whole("baud", (*entry)->baud, 50, 12'000'000);
  DeviceProbe::Settings settings = DeviceProbe::settings_from(options, uri, device);
  auto protocol = (*entry)->make(options);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (!protocol) return about(uri, protocol.error());
  if (uri.path.empty()) {
    return bad_input("\"" + uri.text +
                     "\" names no device: write for example serial:/dev/ttyUSB0?protocol=hbf1");
  }
  if (!is_carried(**entry, uri.scheme)) {
    return bad_input("\"" + uri.text + "\": " + std::string((*entry)->name) +
                     " is only available over udp:HOST:PORT");
  }
  settings.protocol = (*entry)->name;
  settings.hint = "the baud rate (now " + std::to_string(baud) + " Bd; " + settings.protocol +
                  " usually runs at " + std::to_string((*entry)->baud) + ") and the cable";
  auto port = open_serial({.device = uri.path, .baud = static_cast<int>(baud)});
  if (!port) return Unexpected<SetupError>(port.error());
  return DeviceProbe::open(std::move(*port), std::move(*protocol), std::move(settings));
}

Expected<std::unique_ptr<Probe>, SetupError> open_network_device(const Uri& uri,
                                                                 const DeviceUri& device) {
  UriOptions options(uri);
  const auto entry = protocol_of(uri, options);
  if (!entry) return Unexpected<SetupError>(entry.error());
  const bool udp = uri.scheme == "udp";
  const std::string_view name = (*entry)->name;
  if (!is_carried(**entry, uri.scheme)) {
    return bad_input("\"" + uri.text + "\": " + std::string(name) + " is not available over " +
                     uri.scheme + ": write udp:HOST:PORT?protocol=ati_rdt, " +
                     "udp:HOST:PORT?protocol=csv or tcp:HOST:PORT?protocol=csv|hbf1");
  }
  DeviceProbe::Settings settings = DeviceProbe::settings_from(options, uri, device);
  auto protocol = (*entry)->make(options);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (!protocol) return about(uri, protocol.error());
  const auto address = HostAndPort::parse(uri.path);
  if (!address) {
    return bad_input("\"" + uri.text + "\": a host and a port are needed, for example " +
                     uri.scheme + ":127.0.0.1:" + (udp ? "49152" : "5000"));
  }
  settings.protocol = name;
  settings.hint = "its address, and any firewall in between";
  auto port = udp ? open_udp_port({.address = *address,
                                   .listen = !(*entry)->datagrams,
                                   .allow_remote = device.allow_remote,
                                   .datagram_bytes = (*entry)->datagrams ? kAtiRecordBytes : 0})
                  : open_tcp_port(*address);
  if (!port) return Unexpected<SetupError>(port.error());
  return DeviceProbe::open(std::move(*port), std::move(*protocol), std::move(settings));
}

Expected<std::unique_ptr<Probe>, SetupError> open_hid_device(const Uri& uri,
                                                             const DeviceUri& device) {
  UriOptions options(uri);
  const std::string backend = options.word("backend", "hidraw", "hidraw|libusb");
  const auto name = UsbName::parse(uri.path, options.text("serial", ""));
  DeviceProbe::Settings settings = DeviceProbe::settings_from(options, uri, device);
  auto map = read_hid_fields(options);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (!name) return Unexpected<SetupError>(name.error());
  if (!map) return about(uri, map.error());
  settings.protocol = "hid";
  settings.hint = "the field map (fields=…) and report_id";
  auto port = open_hid_port(*name, backend == "hidraw" ? HidBackend::kHidraw : HidBackend::kLibusb);
  if (!port) return Unexpected<SetupError>(port.error());
  if (map->fields.empty()) {
    auto map_read =
        map_report_descriptor((*port)->info().report_descriptor,
                              map->report_id == 0 ? std::nullopt : std::optional(map->report_id));
    if (!map_read) {
      return bad_input("\"" + uri.text + "\": " + map_read.error() +
                       ": add the option fields, for example fields=force_N:0:16:s:0.001");
    }
    map_read->rate_Hz = map->rate_Hz;
    *map = std::move(*map_read);
  }
  return DeviceProbe::open(std::move(*port), make_hid_fields(std::move(*map)), std::move(settings));
}

Expected<std::unique_ptr<Probe>, SetupError> open_usb_device(const Uri& uri,
                                                             const DeviceUri& device) {
  UriOptions options(uri);
  const auto entry = find_protocol(options.text("protocol", ""));
  if (!entry) return about(uri, entry.error());
  const auto name = UsbName::parse(uri.path, options.text("serial", ""));
  constexpr int kIn = 0x80;
  const UsbEndpoints endpoints{
      .interface = static_cast<int>(options.whole("interface", 0, 0, 255)),
      .in = static_cast<std::uint8_t>(options.whole("in", 0x81, kIn + 1, kIn + 15)),
      .out = static_cast<std::uint8_t>(options.whole("out", 0x01, 0, 15)),
      .interrupt = options.word("transfer", "bulk", "bulk|interrupt") == "interrupt"};
  DeviceProbe::Settings settings = DeviceProbe::settings_from(options, uri, device);
  auto protocol = (*entry)->make(options);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (!name) return Unexpected<SetupError>(name.error());
  if (!protocol) return about(uri, protocol.error());
  settings.protocol = (*entry)->name;
  settings.hint = "its interface and endpoints";
  auto port = open_usb_port(*name, endpoints);
  if (!port) return Unexpected<SetupError>(port.error());
  return DeviceProbe::open(std::move(*port), std::move(*protocol), std::move(settings));
}

}  // namespace merkel
