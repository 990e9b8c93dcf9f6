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
  // The rules open devices to users at the machine's own seat, but not to remote logins.
  return verdicts_of("doctor_devices", {{"udev_rules", set_up.udev_rules},
                                        {"systemd_unit", set_up.systemd_unit},
                                        {"serial_group", set_up.serial_group},
                                        {"root", set_up.root},
                                        {"enters", set_up.root || set_up.in_group},
                                        {"joined", set_up.joined}});
}

}  // namespace merkel
