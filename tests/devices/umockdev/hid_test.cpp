#include <functional>
#include <thread>

#include <gtest/gtest.h>

#include "tests/devices/umockdev/listening.hpp"
#include "tests/devices/umockdev/mock_hid_device.hpp"
#include "tests/devices/umockdev/mock_usb_device.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

/// One report of 4 vendor-defined bytes, without an ID.
const Bytes kDescriptor = {0x06, 0x00, 0xff, 0x09, 0x01, 0xa1, 0x01, 0x09, 0x02, 0x15, 0x00,
                           0x26, 0xff, 0x00, 0x75, 0x08, 0x95, 0x04, 0x81, 0x02, 0xc0};
constexpr const char* kFields = "fields=force_N:0:16:s:0.001,seq:16:16:u";

/// Numbered reports with increasing force.
class Reports {
 public:
  [[nodiscard]] Bytes next() {
    ++number_;
    const auto force = static_cast<std::uint8_t>(number_ % 128U);
    return {force, 0, static_cast<std::uint8_t>(number_), static_cast<std::uint8_t>(number_ >> 8U)};
  }
  void skip(unsigned count) { number_ += count; }
  [[nodiscard]] double force_mN() const { return number_ % 128U; }

 private:
  unsigned number_ = 0;
};

std::string text_of(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

/// Both backends of hidapi read the same device.
TEST(MockedHid, HidrawReportsAreReadByTheFieldMapAndTheLostAreCounted) {
  MockMachine machine;
  const MockHidDevice device(machine, "hidraw0", "1-3", "HID77", kDescriptor);
  Reports reports;
  const auto probe = open_while(device.uri() + "?" + kFields, [&] { device.send(reports.next()); });
  ASSERT_NE(probe, nullptr);
  EXPECT_EQ(probe->info().serial_number, "HID77");
  forget_old(*probe);
  for (int i = 0; i < 5; ++i) {
    device.send(reports.next());
    EXPECT_TRUE(gives(*probe, reports.force_mN()));
  }
  reports.skip(7);
  device.send(reports.next());
  EXPECT_TRUE(gives(*probe, reports.force_mN()));
  EXPECT_EQ(probe->device_counts()->lost, 7U);
}

/// One number of 16 bits: a force in mN.
const Bytes kForceDescriptor = {0x05, 0x20, 0x09, 0x01, 0xa1, 0x01, 0x0a, 0x94, 0x04,
                                0x16, 0x00, 0x80, 0x26, 0xff, 0x7f, 0x55, 0x02, 0x66,
                                0x11, 0xe1, 0x75, 0x10, 0x95, 0x01, 0x81, 0x02, 0xc0};

TEST(MockedHid, WithoutAMapTheReportDescriptorIsAsked) {
  MockMachine machine;
  const MockHidDevice device(machine, "hidraw0", "1-3", "HID77", kForceDescriptor);
  const auto probe = open_while(device.uri(), [&] { device.send({0x01, 0x00}); });
  ASSERT_NE(probe, nullptr);
  EXPECT_EQ(probe->info().channels, ProbeSample::kForce);
  forget_old(*probe);
  device.send({0xe8, 0x03});
  EXPECT_TRUE(gives(*probe, 1000.0));
  device.send({0xff, 0x7f});
  EXPECT_TRUE(is_told(*probe, "the sensor is at the end of its range"));
  EXPECT_EQ(probe->device_counts()->saturated, 1U);
}

TEST(MockedHid, ADescriptorThatNamesNothingMeasuredAsksForAMap) {
  MockMachine machine;
  const MockHidDevice device(machine, "hidraw0", "1-3", "HID77", kDescriptor);
  const std::string sentence = refusal(device.uri());
  EXPECT_NE(sentence.find("has no force, depth or position"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("add the option fields"), std::string::npos) << sentence;
}

TEST(MockedHid, OfTwoAlikeTheSerialNumberDecides) {
  MockMachine machine;
  const MockHidDevice one(machine, "hidraw0", "1-3", "ONE", kDescriptor);
  const MockHidDevice two(machine, "hidraw1", "1-4", "TWO", kDescriptor);
  const std::string uri = one.uri() + "?" + kFields;
  Reports reports;
  const auto probe = open_while(uri + "&serial=TWO", [&] { two.send(reports.next()); });
  ASSERT_NE(probe, nullptr);
  EXPECT_EQ(probe->info().serial_number, "TWO");
  EXPECT_NE(refusal(uri + "&serial=THREE").find("there is no device"), std::string::npos);
}

TEST(MockedHid, WithoutPermissionTheErrorHasNodeAndRemedy) {
  MockMachine machine;
  const MockHidDevice device(machine, "hidraw0", "1-3", "HID77", kDescriptor);
  machine.set_rights(device.node(), 0);
  const Unprivileged nobody;
  const std::string sentence = refusal(device.uri() + "?" + kFields);
  EXPECT_NE(sentence.find("no permission to open /dev/hidraw0"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("udev rules"), std::string::npos) << sentence;
}

TEST(MockedHid, ASilentDeviceIsNamed) {
  MockMachine machine;
  const MockHidDevice device(machine, "hidraw0", "1-3", "HID77", kDescriptor);
  const std::string sentence = refusal(device.uri() + "?timeout_ms=200&" + kFields);
  EXPECT_NE(sentence.find("has sent nothing for 0.2 s"), std::string::npos) << sentence;
}

TEST(MockedHid, HidrawIsFoundAgainByItsSerialNumber) {
  MockMachine machine;
  auto device = std::make_unique<MockHidDevice>(machine, "hidraw0", "1-3", "HID77", kDescriptor);
  Reports reports;
  const auto probe =
      open_while(device->uri() + "?" + kFields, [&] { device->send(reports.next()); });
  ASSERT_NE(probe, nullptr);
  device->unplug();
  EXPECT_TRUE(is_told(*probe, "is disconnected"));
  device.reset();
  const MockHidDevice other(machine, "hidraw0", "1-3", "OTHER", kDescriptor);
  const MockHidDevice same(machine, "hidraw1", "1-4", "HID77", kDescriptor);
  const Bytes report = reports.next();
  const std::function<void()> send = [&] {
    other.send({1, 1, 1, 1});
    same.send(report);
  };
  const std::jthread sender = sending(send);
  EXPECT_TRUE(gives(*probe, reports.force_mN()));
  EXPECT_TRUE(is_told(*probe, "is back"));
  EXPECT_EQ(probe->device_counts()->outages, 1U);
}

TEST(MockedHid, TheLibusbBackendReadsReportsAndSeesTheUnplug) {
  MockMachine machine;
  MockUsbDevice device(machine, "1-2", 8, "SN42", kDescriptor);
  const std::string uri = std::string("hid:1209:0001?backend=libusb&") + kFields;
  Reports reports;
  const auto probe =
      open_while(uri, [&] { device.send(MockUsbDevice::kHidIn, text_of(reports.next())); });
  ASSERT_NE(probe, nullptr);
  EXPECT_EQ(probe->info().serial_number, "SN42");
  forget_old(*probe);
  for (int i = 0; i < 5; ++i) {
    device.send(MockUsbDevice::kHidIn, text_of(reports.next()));
    EXPECT_TRUE(gives(*probe, reports.force_mN()));
  }
  device.unplug();
  EXPECT_TRUE(is_told(*probe, "is disconnected"));
  MockUsbDevice same(machine, "1-4", 9, "SN42", kDescriptor);
  const std::string report = text_of(reports.next());
  const std::function<void()> send = [&] { same.send(MockUsbDevice::kHidIn, report); };
  const std::jthread sender = sending(send);
  EXPECT_TRUE(gives(*probe, reports.force_mN()));
  EXPECT_TRUE(is_told(*probe, "is back"));
}

TEST(MockedHid, TheLibusbBackendNamesThePermissionThatItLacks) {
  MockMachine machine;
  const MockUsbDevice device(machine, "1-2", 8, "SN42", kDescriptor);
  machine.set_rights(device.node(), 0);
  const Unprivileged nobody;
  const std::string sentence = refusal(std::string("hid:1209:0001?backend=libusb&") + kFields);
  EXPECT_NE(sentence.find("no permission to open"), std::string::npos) << sentence;
}

}  // namespace
}  // namespace merkel
