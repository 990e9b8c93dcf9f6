#pragma once

#include <string>
#include <vector>

#include "tools/doctor/doctor_verdict.hpp"

namespace merkel {

/// The set-up that decides whether devices can be opened now and after they are plugged in again.
struct DeviceSetUp {
  std::string udev_rules;    ///< path of the installed file; empty if none
  std::string systemd_unit;  ///< the same
  std::string serial_group;  ///< owner of serial ports: dialout or uucp; empty if neither exists
  bool root = false;
  bool in_group = false;  ///< this process is a member
  bool joined = false;    ///< the user becomes a member at the next login

  /// \param root_folder  folder that holds /etc, /run and /usr; "": this machine's
  [[nodiscard]] static DeviceSetUp read(const std::string& root_folder = "");
};

/// Verdicts on the udev rules, the systemd unit and the group, each with its remedy.
[[nodiscard]] std::vector<Verdict> device_verdicts(const DeviceSetUp& set_up);

}  // namespace merkel
