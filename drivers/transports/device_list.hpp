#pragma once

#include <string>
#include <vector>

namespace merkel {

/// A device of this machine that a probe may be.
struct DeviceEntry {
  std::string uri;   ///< begins a probe URI; the protocol is for the user to add
  std::string name;  ///< what the device calls itself
  std::string serial_number;
  std::string latency;  ///< of an FTDI adapter: its timer
  bool usable = false;  ///< we may open it
  std::string remedy;   ///< where not: what to do
};

/// Serial ports, HID devices and all USB devices but hubs: one device may be in the list by several
/// URIs. Opens none of them: that would reset some boards.
[[nodiscard]] std::vector<DeviceEntry> list_devices();

}  // namespace merkel
