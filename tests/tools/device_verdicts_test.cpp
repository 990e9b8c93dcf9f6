#include "tools/doctor/device_verdicts.hpp"

#include <filesystem>

#include <gtest/gtest.h>

#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

using Grade = Verdict::Grade;

TEST(DeviceVerdicts, RulesAndUnitAreFoundWhereTheSystemLooksForThem) {
  const TemporaryFolder folder;
  EXPECT_EQ(DeviceSetUp::read(folder.path("")).udev_rules, "");
  EXPECT_EQ(DeviceSetUp::read(folder.path("")).systemd_unit, "");
  std::filesystem::create_directories(folder.path("opt/merkel/lib/udev/rules.d"));
  static_cast<void>(folder.file("opt/merkel/lib/udev/rules.d/70-merkel.rules", ""));
  EXPECT_EQ(DeviceSetUp::read(folder.path("")).udev_rules, "");  // udev does not look there
  std::filesystem::create_directories(folder.path("usr/local/lib/udev/rules.d"));
  std::filesystem::create_directories(folder.path("usr/local/lib/systemd/system"));
  static_cast<void>(folder.file("usr/local/lib/udev/rules.d/70-merkel.rules", ""));
  static_cast<void>(folder.file("usr/local/lib/systemd/system/merkel@.service", ""));
  const DeviceSetUp set_up = DeviceSetUp::read(folder.path(""));
  EXPECT_EQ(set_up.udev_rules, "/usr/local/lib/udev/rules.d/70-merkel.rules");
  EXPECT_EQ(set_up.systemd_unit, "/usr/local/lib/systemd/system/merkel@.service");
}

TEST(DeviceVerdicts, EverythingMissingHasARemedy) {
  const auto verdicts = device_verdicts({.serial_group = "dialout"});
  ASSERT_EQ(verdicts.size(), 3U);
  EXPECT_EQ(verdicts[0].what, "udev rules");
  EXPECT_EQ(verdicts[0].grade, Grade::kFair);
  EXPECT_NE(verdicts[0].remedy.find("udevadm control --reload"), std::string::npos);
  EXPECT_EQ(verdicts[1].what, "systemd unit");
  EXPECT_NE(verdicts[1].remedy.find("cmake --install"), std::string::npos);
  EXPECT_EQ(verdicts[2].what, "group dialout");
  EXPECT_EQ(verdicts[2].grade, Grade::kPoor);
  EXPECT_NE(verdicts[2].remedy.find("usermod -aG dialout"), std::string::npos);
}

TEST(DeviceVerdicts, WhoHasJoinedTheGroupMustLogInAgain) {
  const auto verdicts =
      device_verdicts({.udev_rules = "/x", .serial_group = "dialout", .joined = true});
  EXPECT_EQ(verdicts[2].grade, Grade::kFair);
  EXPECT_EQ(verdicts[2].remedy, "log in again");
}

TEST(DeviceVerdicts, ACompleteSetUpNeedsNothing) {
  DeviceSetUp set_up{.udev_rules = "/x", .systemd_unit = "/y", .serial_group = "dialout"};
  set_up.in_group = true;
  for (const Verdict& verdict : device_verdicts(set_up)) {
    EXPECT_EQ(verdict.grade, Grade::kGood) << verdict.what;
    EXPECT_EQ(verdict.remedy, "") << verdict.what;
  }
  set_up.in_group = false;
  set_up.root = true;
  EXPECT_EQ(device_verdicts(set_up).back().grade, Grade::kGood);
}

}  // namespace
}  // namespace merkel
