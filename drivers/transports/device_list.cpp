#include "drivers/transports/device_list.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <unistd.h>

#include "drivers/printable_text.hpp"
#include "drivers/transports/descriptor.hpp"
#include "drivers/transports/serial_port.hpp"
#include "drivers/transports/usb_name.hpp"

namespace merkel {
namespace {

void check_access(DeviceEntry& entry, const std::string& device) {
  entry.usable = ::access(device.c_str(), R_OK | W_OK) == 0;
  if (entry.usable) return;
  entry.remedy = errno == ENOENT ? device +
                                       " is missing: if this is a container, pass it in "
                                       "(docker run --device=" +
                                       device + ")"
                                 : port_error(device, errno).sentence;
}

/// The first line of a file; empty if there is none.
std::string line_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

/// The entries of a folder, by name.
std::vector<std::filesystem::path> entries_of(const char* folder) {
  std::error_code ignored;
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::string latency_of(const std::string& device) {
  const std::string latency_ms = line_of("/sys/bus/usb-serial/devices/" +
                                         device.substr(device.rfind('/') + 1) + "/latency_timer");
  return latency_ms.empty() ? "" : latency_ms + " ms";
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
  for (const auto& node : entries_of("/sys/class/hidraw")) {
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
    check_access(entry, "/dev/" + node.filename().string());
    entries.push_back(std::move(entry));
  }
}

void list_usb(std::vector<DeviceEntry>& entries) {
  constexpr const char* kHub = "09";
  for (const auto& device : entries_of("/sys/bus/usb/devices")) {
    const std::string vendor = line_of(device / "idVendor");  // interfaces have none
    if (vendor.empty() || line_of(device / "bDeviceClass") == kHub) continue;
    DeviceEntry entry{.uri = "usb:" + vendor + ":" + line_of(device / "idProduct"),
                      .name = line_of(device / "product"),
                      .serial_number = line_of(device / "serial"),
                      .latency = {}};
    check_access(entry, usb_node(std::strtol(line_of(device / "busnum").c_str(), nullptr, 10),
                                 std::strtol(line_of(device / "devnum").c_str(), nullptr, 10)));
    entries.push_back(std::move(entry));
  }
}

/// Data-acquisition cards, from the kernel's list: " 0: ni_pcimio  pci-6221  14".
void list_comedi(std::vector<DeviceEntry>& entries) {
  std::ifstream cards("/proc/comedi");
  for (std::string line; std::getline(cards, line);) {
    const auto first = line.find_first_not_of(' ');
    const auto colon = line.find(':');
    if (first == std::string::npos || colon == std::string::npos || colon == first) continue;
    const std::string number = line.substr(first, colon - first);
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    std::istringstream words(line.substr(colon + 1));
    DeviceEntry entry{
        .uri = "comedi:/dev/comedi" + number, .name = {}, .serial_number = {}, .latency = {}};
    std::string subdevices;  // the last word
    for (std::string word; words >> word; subdevices = word) {
      if (!subdevices.empty()) entry.name += (entry.name.empty() ? "" : " ") + subdevices;
    }
    check_access(entry, "/dev/comedi" + number);
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
    check_access(entry, port.device);
    entries.push_back(std::move(entry));
  }
  list_hid(entries);
  list_usb(entries);
  list_comedi(entries);
  // A device may call itself anything.
  for (DeviceEntry& entry : entries) {
    entry.name = printable_text(entry.name);
    entry.serial_number = printable_text(entry.serial_number);
  }
  return entries;
}

}  // namespace merkel
