#include <gtest/gtest.h>

#include "drivers/protocols/protocol_makers.hpp"
#include "tests/drivers/protocols/protocol_harness.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

void append_be(std::uint32_t number, Bytes& bytes) {
  for (int shift = 24; shift >= 0; shift -= 8) {
    bytes.push_back(static_cast<std::uint8_t>(number >> shift));
  }
}

Bytes record(std::uint32_t rdt, std::int32_t fz, std::uint32_t status = 0) {
  Bytes bytes;
  for (const std::uint32_t word :
       {rdt, rdt * 7, status, 0U, 0U, static_cast<std::uint32_t>(fz), 1U, 2U, 3U}) {
    append_be(word, bytes);
  }
  return bytes;
}

TEST(AtiRdt, AsksForAStreamAndStopsIt) {
  Talk talk("ati_rdt");
  EXPECT_EQ(talk.stream.outgoing, (Bytes{0x12, 0x34, 0x00, 0x02, 0, 0, 0, 0}));
  talk.stream.outgoing.clear();
  talk.protocol->end(talk.stream);
  EXPECT_EQ(talk.stream.outgoing, (Bytes{0x12, 0x34, 0x00, 0x00, 0, 0, 0, 0}));
}

TEST(AtiRdt, ReadsForcesAndCountsLostRecords) {
  Talk talk("ati_rdt", "counts_per_N=1000000&rate_hz=1000");
  talk.take(record(1, 250'000));
  talk.take(record(2, -1'000'000));
  talk.take(record(2, -1'000'000));
  talk.take(record(6, 500'000));
  ASSERT_EQ(talk.stream.readings.size(), 3U);
  EXPECT_EQ(talk.stream.readings[0][DeviceChannel::kForceZ], 0.25);
  EXPECT_EQ(talk.stream.readings[1][DeviceChannel::kForceZ], -1.0);
  EXPECT_EQ(talk.stream.readings[2].lost, 3U);
  EXPECT_EQ(talk.stream.readings[2].device_time, milliseconds{6});
  EXPECT_EQ(talk.stream.counts.duplicates, 1U);
  EXPECT_EQ(talk.stream.counts.lost, 3U);
}

TEST(AtiRdt, AStatusIsReportedOnceAndOverRangeIsSaturated) {
  Talk talk("ati_rdt");
  talk.take(record(1, 0));
  talk.take(record(2, 0, 0x00020000));
  talk.take(record(3, 0, 0x00020000));
  EXPECT_EQ(talk.stream.notices.size(), 1U);
  EXPECT_FALSE(talk.stream.readings[0].saturated);
  EXPECT_TRUE(talk.stream.readings[2].saturated);
}

// An Axia sets bit 31 with every error.
TEST(AtiRdt, TheRangeBitsOfAnAxiaAreSaturationAndItsOtherErrorsAreNot) {
  Talk talk("ati_rdt");
  talk.take(record(1, 0, 0x88000000));
  talk.take(record(2, 0, 0xC0000000));
  talk.take(record(3, 0, 0x80000001));
  ASSERT_EQ(talk.stream.notices.size(), 3U);
  EXPECT_NE(talk.stream.notices[0].find("gage, force or torque is out of range"),
            std::string::npos);
  EXPECT_TRUE(talk.stream.readings[0].saturated);
  EXPECT_TRUE(talk.stream.readings[1].saturated);
  EXPECT_FALSE(talk.stream.readings[2].saturated);
  EXPECT_NE(talk.stream.notices[2].find("web page"), std::string::npos);
}

TEST(AtiRdt, AsksAgainWhenTheRequestWasLost) {
  Talk talk("ati_rdt");
  talk.stream.outgoing.clear();
  talk.now += milliseconds{600};
  static_cast<void>(talk.protocol->poll(talk.now, talk.stream));
  EXPECT_EQ(talk.stream.outgoing.size(), 8U);
}

TEST(AtiRdt, ItsSimulatedDeviceIsRead) {
  Talk talk("ati_rdt");
  const auto device = make_ati_rdt_device(ProbeSample::kForce);
  Bytes wire;
  device->boot(talk.now, wire);
  EXPECT_FALSE(device->started());
  device->take(talk.stream.outgoing, talk.now, wire);
  ASSERT_TRUE(device->started());
  for (int k = 0; k < 100; ++k) {
    device->measure({.force_mN = 5.0 * k, .channels = ProbeSample::kForce}, {}, talk.now, wire);
  }
  talk.take(wire);
  ASSERT_EQ(talk.stream.readings.size(), 100U);
  EXPECT_NEAR(talk.stream.readings[99][DeviceChannel::kForceZ], 0.495, 1e-6);
  EXPECT_EQ(talk.stream.counts.lost, 0U);
}

TEST(AtiRdt, ItsSimulatedDeviceSendsAsManyRecordsAsRequested) {
  const auto device = make_ati_rdt_device(ProbeSample::kForce);
  const Bytes three = {0x12, 0x34, 0x00, 0x02, 0, 0, 0, 3};
  Bytes wire;
  device->boot(milliseconds{0}, wire);
  device->take(three, milliseconds{0}, wire);
  for (int k = 0; k < 10; ++k) {
    device->measure({.force_mN = 5.0, .channels = ProbeSample::kForce}, {}, milliseconds{k}, wire);
  }
  EXPECT_EQ(wire.size(), 3 * kAtiRecordBytes);
  EXPECT_FALSE(device->started());
}

}  // namespace
}  // namespace merkel
