#include "drivers/transports/device_list.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <filesystem>
#include <fstream>

#include <unistd.h>

#include "drivers/transports/descriptor.hpp"
#include "drivers/transports/serial_port.hpp"

namespace merkel {
namespace {

void judge(DeviceEntry& entry, const std::string& device) {
  entry.usable = ::access(device.c_str(), R_OK | W_OK) == 0;
  if (!entry.usable) entry.mend = port_trouble(device, errno).sentence;
}

std::string latency_of(const std::string& device) {
  std::ifstream timer("/sys/bus/usb-serial/devices/" + device.substr(device.rfind('/') + 1) +
                      "/latency_timer");
  std::string milliseconds;
  return timer >> milliseconds ? milliseconds + " ms" : "";
}

/// "HID_ID=0003:000016C0:00000486" → "16c0:0486"
std::string vid_pid(const std::string& id) {
  const auto first = id.find(':');
  const auto second = id.find(':', first + 1);
  if (first == std::string::npos || second == std::string::npos || id.size() < second + 9)
    return {};
  std::string text = id.substr(second - 4, 4) + ":" + id.substr(second + 5, 4);
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

void list_hid(std::vector<DeviceEntry>& entries) {
  std::error_code ignored;
  std::vector<std::filesystem::path> nodes;
  for (const auto& node : std::filesystem::directory_iterator("/sys/class/hidraw", ignored)) {
    nodes.push_back(node.path());
  }
  std::sort(nodes.begin(), nodes.end());
  for (const auto& node : nodes) {
    DeviceEntry entry;
    std::string id;
    std::ifstream uevent(node / "device" / "uevent");
    for (std::string line; std::getline(uevent, line);) {
      if (line.starts_with("HID_ID=")) id = line.substr(7);
      if (line.starts_with("HID_NAME=")) entry.name = line.substr(9);
      if (line.starts_with("HID_UNIQ=")) entry.serial_number = line.substr(9);
    }
    const std::string name = vid_pid(id);
    if (name.empty()) continue;
    entry.uri = "hid:" + name;
    judge(entry, "/dev/" + node.filename().string());
    entries.push_back(std::move(entry));
  }
}

}  // namespace

std::vector<DeviceEntry> list_devices() {
  std::vector<DeviceEntry> entries;
  for (const SerialPortInfo& port : list_serial_ports()) {
    DeviceEntry entry{.uri = "serial:" + port.device,
                      .name = port.description,
                      .serial_number = port.serial_number,
                      .latency = latency_of(port.device)};
    judge(entry, port.device);
    entries.push_back(std::move(entry));
  }
  list_hid(entries);
  return entries;
}

}  // namespace merkel
