#pragma once

#include <string>
#include <vector>

#include "tools/doctor/verdict.hpp"

namespace merkel {

/// What decides whether devices can be opened here, now and after they are plugged in again.
struct DeviceSetUp {
  std::string udev_rules;    ///< path of the installed file; empty where there is none
  std::string systemd_unit;  ///< the same
  std::string
      serial_group;  ///< that owns serial ports: dialout or uucp; empty where neither exists
  bool root = false;
  bool in_group = false;  ///< this process is
  bool joined = false;    ///< the user is, from the next login on

  /// \param root_folder  where /etc, /run and /usr are found; "" for this machine
  [[nodiscard]] static DeviceSetUp read(const std::string& root_folder = "");
};

/// A verdict on the udev rules, the systemd unit and the group, each with its remedy.
[[nodiscard]] std::vector<Verdict> device_verdicts(const DeviceSetUp& set_up);

}  // namespace merkel
