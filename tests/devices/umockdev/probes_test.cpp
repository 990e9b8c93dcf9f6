#include <algorithm>
#include <atomic>
#include <filesystem>
#include <system_error>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "drivers/protocols/trace_file.hpp"
#include "drivers/transports/device_list.hpp"
#include "tests/devices/umockdev/mock_hid_device.hpp"
#include "tests/devices/umockdev/mock_serial_adapter.hpp"
#include "tests/devices/umockdev/mock_usb_device.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

const Bytes kListedDescriptor = {0x06, 0x00, 0xff, 0x09, 0x01, 0xa1, 0x01, 0x09, 0x02, 0x15, 0x00,
                                 0x26, 0xff, 0x00, 0x75, 0x08, 0x95, 0x04, 0x81, 0x02, 0xc0};

/// Ubuntu 24.04's libstdc++ opens folders by __openat_2, which umockdev 0.18 leaves as it is.
bool folders_are_mocked() {
  std::error_code ignored;
  return std::filesystem::directory_iterator("/sys/class/hidraw", ignored) !=
         std::filesystem::directory_iterator();
}

TEST(MockedProbes, TheProgramListsSerialHidAndUsbDevicesWithTheirNumbers) {
  if (const std::string obstacle = MockSerialAdapter::obstacle(); !obstacle.empty()) {
    GTEST_SKIP() << obstacle;
  }
  MockMachine machine;
  const MockSerialAdapter adapter(machine, "ttyUSB0", "1-1", "A1B2C3");
  const MockHidDevice hid(machine, "hidraw0", "1-3", "HID77", kListedDescriptor);
  const MockUsbDevice usb(machine, "1-2", 8, "SN42");
  ASSERT_TRUE(std::filesystem::exists("/sys/class/hidraw/hidraw0"));
  if (!folders_are_mocked()) GTEST_SKIP() << "this umockdev does not show folders to libstdc++";
  const auto run = run_program({"probes", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto devices = nlohmann::json::parse(run.out)["devices"];
  const auto find = [&](const std::string& uri) {
    const auto found = std::find_if(devices.begin(), devices.end(),
                                    [&](const auto& device) { return device["uri"] == uri; });
    EXPECT_NE(found, devices.end()) << uri << " is not in " << devices.dump(2);
    return found == devices.end() ? nlohmann::json::object() : *found;
  };
  const auto serial = find("serial:/dev/ttyUSB0");
  EXPECT_EQ(serial["serial_number"], "A1B2C3");
  EXPECT_EQ(serial["latency_timer"], "16 ms");
  EXPECT_EQ(serial["usable"], true);
  EXPECT_EQ(find("hid:16c0:0486")["serial_number"], "HID77");
  EXPECT_EQ(find("hid:16c0:0486")["name"], "PJRC RawHID");
  EXPECT_EQ(find("usb:1209:0001")["serial_number"], "SN42");
  EXPECT_EQ(find("usb:1209:0001")["name"], "Force Probe");
  EXPECT_EQ(find("usb:1209:0001")["usable"], true);
  EXPECT_EQ(find("usb:1209:0001")["remedy"], "");
}

TEST(MockedProbes, ADeviceWithoutPermissionGetsReasonAndRemedy) {
  if (const std::string obstacle = MockSerialAdapter::obstacle(); !obstacle.empty()) {
    GTEST_SKIP() << obstacle;
  }
  MockMachine machine;
  const MockSerialAdapter adapter(machine, "ttyUSB0", "1-1", "A1B2C3");
  const MockHidDevice hid(machine, "hidraw0", "1-3", "HID77", kListedDescriptor);
  const MockUsbDevice usb(machine, "1-2", 8, "SN42");
  ASSERT_TRUE(std::filesystem::exists("/sys/class/hidraw/hidraw0"));
  if (!folders_are_mocked()) GTEST_SKIP() << "this umockdev does not show folders to libstdc++";
  machine.set_rights("/dev/ttyUSB0", 0);
  machine.set_rights(hid.node(), 0);
  machine.set_rights(usb.node(), 0);
  const Unprivileged nobody;
  std::size_t refused = 0;
  for (const DeviceEntry& device : list_devices()) {
    EXPECT_FALSE(device.usable) << device.uri;
    if (device.remedy.find("no permission to open /dev/") == std::string::npos) continue;
    EXPECT_NE(device.remedy.find("70-merkel.rules"), std::string::npos) << device.remedy;
    ++refused;
  }
  EXPECT_EQ(refused, 3U);
}

TEST(MockedProbes, TheProgramRecordsFromAUsbDevice) {
  MockMachine machine;
  MockUsbDevice usb(machine, "1-2", 8, "SN42");
  std::jthread sender([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      usb.send(MockUsbDevice::kBulkIn, "0.5\n");
      std::this_thread::sleep_for(std::chrono::milliseconds{2});
    }
  });
  const TemporaryFolder folder;
  const auto run = run_program({"record", "usb:1209:0001?protocol=csv&columns=force_N&serial=SN42",
                                folder.path("t.csv"), "--duration-s", "0.3"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  auto trace = TraceReader::open(folder.path("t.csv"));
  ASSERT_TRUE(trace);
  std::vector<ProbeSample> samples(1000);
  const std::size_t count = *trace->read(samples);
  EXPECT_GE(count, 5U);
  for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(samples[i].force_mN, 500.0);
}

}  // namespace
}  // namespace merkel
