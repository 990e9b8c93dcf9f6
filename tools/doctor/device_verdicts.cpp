#include "tools/doctor/device_verdicts.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <string_view>

#include <grp.h>
#include <pwd.h>
#include <unistd.h>

namespace merkel {
namespace {

using Grade = Verdict::Grade;

/// Search path of udev and systemd, in order: a file in an earlier folder hides later ones.
constexpr std::array<std::string_view, 5> kPlaces = {"/etc", "/run", "/usr/local/lib", "/usr/lib",
                                                     "/lib"};

std::string find_file(const std::string& root_folder, const std::string& name) {
  for (const std::string_view place : kPlaces) {
    const std::string path = std::string(place) + name;
    std::error_code none;
    if (std::filesystem::exists(root_folder + path, none)) return path;
  }
  return {};
}

bool is_in(gid_t group) {
  const int count = ::getgroups(0, nullptr);
  std::vector<gid_t> groups(static_cast<std::size_t>(std::max(count, 0)));
  if (::getgroups(count, groups.data()) < 0) return false;
  groups.push_back(::getegid());
  return std::find(groups.begin(), groups.end(), group) != groups.end();
}

bool lists_user(const group& group) {
  const passwd* const user = ::getpwuid(::getuid());
  if (user == nullptr) return false;
  for (char** member = group.gr_mem; *member != nullptr; ++member) {
    if (std::string_view(*member) == user->pw_name) return true;
  }
  return false;
}

Verdict group_verdict(const DeviceSetUp& set_up) {
  Verdict verdict{Grade::kGood, "group " + set_up.serial_group, "", ""};
  if (set_up.root || set_up.in_group) {
    verdict.finding = set_up.root ? "not needed by root" : "you are a member";
    return verdict;
  }
  // The rules open devices to users at the machine's own seat, but not to remote logins.
  verdict.grade = set_up.udev_rules.empty() ? Grade::kPoor : Grade::kFair;
  verdict.finding =
      set_up.joined ? "you will be a member after the next login" : "you are not a member";
  verdict.remedy = set_up.joined ? "log in again"
                                 : "sudo usermod -aG " + set_up.serial_group +
                                       " $USER, then log in again: serial ports belong to this "
                                       "group";
  return verdict;
}

}  // namespace

DeviceSetUp DeviceSetUp::read(const std::string& root_folder) {
  DeviceSetUp set_up;
  set_up.udev_rules = find_file(root_folder, "/udev/rules.d/70-merkel.rules");
  set_up.systemd_unit = find_file(root_folder, "/systemd/system/merkel@.service");
  set_up.root = ::geteuid() == 0;
  for (const char* const name : {"dialout", "uucp"}) {
    const group* const found = ::getgrnam(name);
    if (found == nullptr) continue;
    set_up.serial_group = name;
    set_up.in_group = is_in(found->gr_gid);
    set_up.joined = lists_user(*found);
    break;
  }
  return set_up;
}

std::vector<Verdict> device_verdicts(const DeviceSetUp& set_up) {
  std::vector<Verdict> verdicts;
  const bool rules = !set_up.udev_rules.empty();
  verdicts.push_back(
      {rules ? Grade::kGood : Grade::kFair, "udev rules",
       rules ? set_up.udev_rules : "not installed",
       rules
           ? ""
           : "sudo cmake --install build/release && sudo udevadm control --reload && sudo udevadm "
             "trigger (without the rules, only root can open HID and USB probes, ModemManager "
             "probes new serial ports, and FTDI adapters delay bytes by 16 ms)"});
  const bool unit = !set_up.systemd_unit.empty();
  verdicts.push_back({unit ? Grade::kGood : Grade::kFair, "systemd unit",
                      unit ? set_up.systemd_unit : "not installed",
                      unit ? ""
                           : "sudo cmake --install build/release && sudo systemctl daemon-reload, "
                             "to run a scene at boot"});
  if (!set_up.serial_group.empty()) verdicts.push_back(group_verdict(set_up));
  return verdicts;
}

}  // namespace merkel
