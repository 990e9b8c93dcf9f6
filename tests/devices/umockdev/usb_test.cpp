#include <array>
#include <functional>
#include <thread>

#include <gtest/gtest.h>

#include "drivers/transports/usb_port.hpp"
#include "tests/devices/umockdev/listening.hpp"
#include "tests/devices/umockdev/mock_usb_device.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

constexpr const char* kUsbUri = "usb:1209:0001?protocol=csv&columns=force_N";

std::unique_ptr<Transport> opened(const UsbEndpoints& endpoints = {}) {
  auto port = open_usb_port({.vendor = 0x1209, .product = 0x0001, .serial_number = ""}, endpoints);
  EXPECT_TRUE(port.has_value()) << port.error().sentence;
  return port ? std::move(*port) : nullptr;
}

/// Reads until this number of bytes has arrived or the device is disconnected.
struct Read {
  std::string bytes;
  bool gone = false;
};
Read read(Transport& port, std::size_t count) {
  Read result;
  std::array<std::uint8_t, 256> bytes{};
  for (int reads = 0; reads < kPatience && result.bytes.size() < count; ++reads) {
    const auto got = port.read(bytes, milliseconds{10});
    if (!got) {
      result.gone = true;
      break;
    }
    result.bytes.append(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(*got));
  }
  return result;
}

TEST(MockedUsb, EightTransfersAreUnderWayAndBytesKeepTheirOrder) {
  MockMachine machine;
  MockUsbDevice device(machine, "1-2", 8, "SN42");
  const auto port = opened();
  ASSERT_NE(port, nullptr);
  EXPECT_EQ(port->info().serial_number, "SN42");
  EXPECT_EQ(port->info().note, "bulk transfers");
  EXPECT_EQ(device.waiting(MockUsbDevice::kBulkIn), 8U);
  // Without a reader, only the submitted transfers complete.
  std::string sent;
  for (int i = 0; i < 8; ++i) {
    const std::string packet = "packet " + std::to_string(i) + "\n";
    device.send(MockUsbDevice::kBulkIn, packet);
    sent += packet;
  }
  EXPECT_EQ(device.left(MockUsbDevice::kBulkIn), 0U);
  EXPECT_EQ(read(*port, sent.size()).bytes, sent);
  for (int i = 0; i < 100; ++i) {
    const std::string packet = std::to_string(i) + ";";
    device.send(MockUsbDevice::kBulkIn, packet);
    sent = i == 0 ? packet : sent + packet;
  }
  EXPECT_EQ(read(*port, sent.size()).bytes, sent);
  EXPECT_EQ(device.waiting(MockUsbDevice::kBulkIn), 8U);
}

TEST(MockedUsb, InterruptEndpointsAreReadToo) {
  MockMachine machine;
  MockUsbDevice device(machine, "1-2", 8, "SN42");
  const auto port = opened({.in = MockUsbDevice::kInterruptIn, .out = 0, .interrupt = true});
  ASSERT_NE(port, nullptr);
  EXPECT_EQ(port->info().note, "interrupt transfers");
  device.send(MockUsbDevice::kInterruptIn, "here");
  EXPECT_EQ(read(*port, 4).bytes, "here");
}

TEST(MockedUsb, WhatIsWrittenArrivesAlsoThroughAHaltedEndpoint) {
  MockMachine machine;
  MockUsbDevice device(machine, "1-2", 8, "SN42");
  const auto port = opened();
  ASSERT_NE(port, nullptr);
  EXPECT_TRUE(port->write(Bytes{'a', 'b'}).has_value());
  device.stall(MockUsbDevice::kBulkOut);
  EXPECT_TRUE(port->write(Bytes{'c'}).has_value());
  EXPECT_EQ(device.received(), "abc");
  EXPECT_EQ(device.halts_cleared(), 1U);
}

TEST(MockedUsb, AStalledEndpointIsClearedAndReadOn) {
  MockMachine machine;
  MockUsbDevice device(machine, "1-2", 8, "SN42");
  const auto port = opened();
  ASSERT_NE(port, nullptr);
  for (int round = 0; round < 20; ++round) {
    device.send(MockUsbDevice::kBulkIn, "before;");
    device.stall(MockUsbDevice::kBulkIn);
    device.send(MockUsbDevice::kBulkIn, "after;");
    const Read heard = read(*port, 13);
    EXPECT_FALSE(heard.gone);
    EXPECT_EQ(heard.bytes, "before;after;");
  }
  EXPECT_GE(device.halts_cleared(), 20U);
}

TEST(MockedUsb, AnEndpointThatStallsWithoutEndIsGivenUp) {
  MockMachine machine;
  MockUsbDevice device(machine, "1-2", 8, "SN42");
  const auto port = opened();
  ASSERT_NE(port, nullptr);
  device.stall(MockUsbDevice::kBulkIn, true);
  EXPECT_TRUE(read(*port, 1).gone);
}

TEST(MockedUsb, AProtocolErrorEndsTheConnectionAndItIsOpenedAgain) {
  MockMachine machine;
  MockUsbDevice device(machine, "1-2", 8, "SN42");
  const auto probe = open_while(kUsbUri, [&] { device.send(MockUsbDevice::kBulkIn, "0.5\n"); });
  ASSERT_NE(probe, nullptr);
  device.fail(MockUsbDevice::kBulkIn, MockUsbDevice::kProtocolError);
  EXPECT_TRUE(is_told(*probe, "is disconnected"));
  const std::function<void()> send = [&] { device.send(MockUsbDevice::kBulkIn, "0.25\n"); };
  const std::jthread sender = sending(send);
  EXPECT_TRUE(is_told(*probe, "is back"));
  EXPECT_TRUE(gives(*probe, 250.0));
  EXPECT_EQ(probe->device_counts()->outages, 1U);
}

TEST(MockedUsb, UnpluggedItIsFoundAgainByItsSerialNumberAtAnotherPort) {
  MockMachine machine;
  MockUsbDevice device(machine, "1-2", 8, "SN42");
  const auto probe = open_while(kUsbUri, [&] { device.send(MockUsbDevice::kBulkIn, "0.5\n"); });
  ASSERT_NE(probe, nullptr);
  EXPECT_EQ(probe->info().serial_number, "SN42");
  device.unplug();
  EXPECT_TRUE(is_told(*probe, "is disconnected"));
  MockUsbDevice other(machine, "1-3", 9, "OTHER");
  MockUsbDevice same(machine, "1-4", 10, "SN42");
  const std::function<void()> send = [&] {
    other.send(MockUsbDevice::kBulkIn, "0.125\n");
    same.send(MockUsbDevice::kBulkIn, "0.25\n");
  };
  const std::jthread sender = sending(send);
  EXPECT_TRUE(is_told(*probe, "is back"));
  EXPECT_TRUE(gives(*probe, 250.0));
  EXPECT_EQ(probe->device_counts()->outages, 1U);
}

TEST(MockedUsb, EveryFailureToOpenHasARemedy) {
  MockMachine machine;
  MockUsbDevice device(machine, "1-2", 8, "SN42");
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"usb:1209:0002?protocol=csv&columns=force_N", "there is no device usb:1209:0002"},
      {std::string(kUsbUri) + "&serial=SN43", "there is no device usb:1209:0001"},
      {std::string(kUsbUri) + "&interface=3", "has no interface 3"},
      {std::string(kUsbUri) + "&in=132", "has no bulk endpoint 132"},
      {std::string(kUsbUri) + "&out=2", "has no bulk endpoint 2"},
      {std::string(kUsbUri) + "&transfer=interrupt", "has no interrupt endpoint 129"},
  };
  for (const auto& [uri, words] : cases) {
    const std::string sentence = refusal(uri);
    EXPECT_NE(sentence.find(words), std::string::npos) << uri << ": " << sentence;
  }
  device.set_busy(true);
  EXPECT_NE(refusal(kUsbUri).find("in use by another program"), std::string::npos);
  device.set_busy(false);
  machine.set_rights(device.node(), 0);
  const Unprivileged nobody;
  const std::string sentence = refusal(kUsbUri);
  EXPECT_NE(sentence.find("no permission to open"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("udev rules"), std::string::npos) << sentence;
}

}  // namespace
}  // namespace merkel
