#include <cstdio>
#include <memory>
#include <string>

#include "drivers/protocols/protocol_table.hpp"
#include "drivers/transports/device_list.hpp"
#include "tools/commands/command.hpp"
#include "tools/filled_text.hpp"
#include "tools/json_text.hpp"

namespace merkel {
namespace {

int list_probes(bool json) {
  auto devices = Json::array();
  for (const DeviceEntry& device : list_devices()) {
    devices.push_back({{"uri", device.uri},
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
  const Json all = {{"devices", devices}, {"protocols", protocols}};
  std::fputs((json ? json_text(all) : filled_text("probes", all)).c_str(), stdout);
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
