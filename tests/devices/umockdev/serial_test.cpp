#include <functional>
#include <thread>

#include <gtest/gtest.h>

#include "drivers/transports/serial_port.hpp"
#include "tests/devices/umockdev/listening.hpp"
#include "tests/devices/umockdev/mock_serial_adapter.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

constexpr const char* kUri = "serial:/dev/ttyUSB0?protocol=csv&columns=force_N";

class MockedSerial : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string obstacle = MockSerialAdapter::obstacle(); !obstacle.empty()) {
      GTEST_SKIP() << obstacle;
    }
  }
};

TEST_F(MockedSerial, LibserialportFindsVendorProductAndSerialNumber) {
  MockMachine machine;
  const MockSerialAdapter adapter(machine, "ttyUSB0", "1-1", "A1B2C3");
  const auto ports = list_serial_ports();
  ASSERT_EQ(ports.size(), 1U);
  EXPECT_EQ(ports[0].device, "/dev/ttyUSB0");
  EXPECT_EQ(ports[0].vendor, 0x0403);
  EXPECT_EQ(ports[0].product, 0x6001);
  EXPECT_EQ(ports[0].serial_number, "A1B2C3");
}

TEST_F(MockedSerial, TheLowLatencyFlagIsSetReadBackAndReported) {
  MockMachine machine;
  const MockSerialAdapter adapter(machine, "ttyUSB0", "1-1", "A1B2C3");
  const auto port = open_serial_port({.device = "/dev/ttyUSB0", .baud = 115200});
  ASSERT_TRUE(port.has_value()) << port.error().sentence;
  EXPECT_EQ((*port)->info().note, "low-latency flag set, latency timer 16 ms");
  EXPECT_EQ((*port)->info().serial_number, "A1B2C3");
}

TEST_F(MockedSerial, APortThatIsInUseIsRefused) {
  MockMachine machine;
  const MockSerialAdapter adapter(machine, "ttyUSB0", "1-1", "A1B2C3");
  const auto first = open_serial_port({.device = "/dev/ttyUSB0"});
  ASSERT_TRUE(first.has_value());
  const auto second = open_serial_port({.device = "/dev/ttyUSB0"});
  ASSERT_FALSE(second.has_value());
  EXPECT_NE(second.error().sentence.find("in use by another program"), std::string::npos);
}

TEST_F(MockedSerial, WithoutPermissionTheGroupIsNamed) {
  MockMachine machine;
  const MockSerialAdapter adapter(machine, "ttyUSB0", "1-1", "A1B2C3");
  machine.set_rights("/dev/ttyUSB0", 0);
  const Unprivileged nobody;
  const std::string sentence = refusal(kUri);
  EXPECT_NE(sentence.find("no permission to open /dev/ttyUSB0"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("usermod -aG"), std::string::npos) << sentence;
}

TEST_F(MockedSerial, ItIsFoundAgainByItsSerialNumberUnderAnotherName) {
  MockMachine machine;
  auto adapter = std::make_unique<MockSerialAdapter>(machine, "ttyUSB0", "1-1", "A1B2C3");
  const auto probe = open_while(kUri, [&] { adapter->send("0.5\n"); });
  ASSERT_NE(probe, nullptr);
  EXPECT_EQ(probe->info().serial_number, "A1B2C3");
  forget_old(*probe);
  adapter->send("0.25\n0.75\n");
  const auto heard = listen(*probe, 2);
  EXPECT_DOUBLE_EQ(heard.at(0).force_mN, 250.0);
  EXPECT_DOUBLE_EQ(heard.at(1).force_mN, 750.0);

  adapter.reset();
  EXPECT_TRUE(is_told(*probe, "is disconnected"));
  const MockSerialAdapter other(machine, "ttyUSB1", "1-4", "OTHER");
  const MockSerialAdapter same(machine, "ttyUSB2", "1-2", "A1B2C3");
  const std::function<void()> send = [&] {
    other.send("0.125\n");
    same.send("0.0625\n");
  };
  const std::jthread sender = sending(send);
  EXPECT_TRUE(is_told(*probe, "is back"));
  EXPECT_TRUE(gives(*probe, 62.5));
  EXPECT_EQ(probe->device_counts()->outages, 1U);
}

}  // namespace
}  // namespace merkel
