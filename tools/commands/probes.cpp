#include <cstdio>
#include <memory>
#include <string>

#include "drivers/protocols/protocol_table.hpp"
#include "drivers/transports/device_list.hpp"
#include "tools/commands/command.hpp"
#include "tools/json_text.hpp"
#include "tools/print_text.hpp"

namespace merkel {
namespace {

int list_probes(bool json) {
  const auto devices = list_devices();
  if (json) {
    auto list = Json::array();
    for (const DeviceEntry& device : devices) {
      list.push_back({{"uri", device.uri},
                      {"name", device.name},
                      {"serial_number", device.serial_number},
                      {"latency_timer", device.latency},
                      {"usable", device.usable},
                      {"remedy", device.remedy}});
    }
    auto protocols = Json::array();
    for (const ProtocolEntry& entry : protocol_table()) {
      protocols.push_back({{"name", entry.name}, {"what", entry.what}, {"baud", entry.baud}});
    }
    const Json all = {{"devices", list}, {"protocols", protocols}};
    std::fputs(json_text(all).c_str(), stdout);
    return kDone;
  }
  for (const DeviceEntry& device : devices) {
    print_text(stdout, "{}  {}{}{}{}{}\n", device.uri,
               device.name.empty() ? "(no name)" : device.name,
               device.serial_number.empty() ? "" : ", serial number ", device.serial_number,
               device.latency.empty() ? "" : ", latency timer ", device.latency);
    if (!device.usable) print_text(stdout, "  {}\n", device.remedy);
  }
  if (devices.empty()) {
    std::printf(
        "no serial port, HID or USB device is plugged in; without one, try\n"
        "  merkel simulate-probe hbf1 --trace tests/traces/taps.csv\n");
  }
  std::printf("protocols of serial devices (protocol=NAME):\n");
  for (const ProtocolEntry& entry : protocol_table()) {
    print_text(stdout, "  {:<10} {}, {} Bd\n", entry.name, entry.what, entry.baud);
  }
  return kDone;
}

}  // namespace

void add_probes_command(CommandLine& program) {
  auto json = std::make_shared<bool>(false);
  program
      .subcommand("probes",
                  "Lists the devices on this machine, whether each can be opened and what to do if "
                  "not, and the known protocols. Opens no device.",
                  "probes")
      .flag("--json", *json, "Print the list as JSON")
      .runs([json] { return list_probes(*json); });
}

}  // namespace merkel
