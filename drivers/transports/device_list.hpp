#pragma once

#include <string>
#include <vector>

namespace merkel {

/// A device of this machine that may be a probe.
struct DeviceEntry {
  std::string uri;   ///< start of a probe URI; the user adds the protocol
  std::string name;  ///< the device's own name
  std::string serial_number;
  std::string latency;  ///< latency timer of an FTDI adapter
  bool usable = false;  ///< this process may open it
  std::string remedy;   ///< if not usable: what to do
};

/// Serial ports, HID devices, all USB devices except hubs, and data-acquisition cards. A device may
/// appear with several URIs. Opens no device, because opening would reset some boards.
[[nodiscard]] std::vector<DeviceEntry> list_devices();

}  // namespace merkel
