#include "drivers/protocols/hid_report_descriptor.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "drivers/protocols/hid_fields.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

/// A probe: u16 number, i16 force in mN, u32 time in µs.
const Bytes kProbe = {0x06, 0x00, 0xff, 0x09, 0x01, 0xa1, 0x01,  // a vendor's application
                      0x09, 0x02, 0x15, 0x00, 0x27, 0xff, 0xff, 0x00, 0x00,  // number, 0 to 65535
                      0x75, 0x10, 0x95, 0x01, 0x81, 0x02,                    // 16 bits
                      0x05, 0x20, 0x0a, 0x94, 0x04,                          // sensor page, force
                      0x16, 0x00, 0x80, 0x26, 0xff, 0x7f,                    // −32768 to 32767
                      0x36, 0x00, 0x80, 0x46, 0xff, 0x7f,        // the same in 100 g·cm/s²
                      0x55, 0x02, 0x66, 0x11, 0xe1, 0x81, 0x02,  //
                      0x0a, 0x29, 0x05, 0x15, 0x00, 0x27, 0xff, 0xff, 0xff, 0xff,  // time, 32 bits
                      0x35, 0x00, 0x47, 0xff, 0xff, 0xff, 0xff, 0x55, 0x0a, 0x66, 0x01,  // in µs
                      0x10, 0x75, 0x20, 0x81, 0x02, 0xc0};

/// A stage with numbered reports: 1 has keys; 2 has X, Y, Z of 12 bits in 1/100 inch after 4 bits
/// of padding, and an 8-bit length in µm that is no axis, 0 to 200 for 0 to 1000.
const Bytes kStage = {
    0x05, 0x01, 0x09, 0x04, 0xa1, 0x01,                                      //
    0x85, 0x01, 0x05, 0x09, 0x19, 0x01, 0x29, 0x08, 0x15, 0x00, 0x25, 0x01,  // eight keys
    0x75, 0x01, 0x95, 0x08, 0x81, 0x02,                                      //
    0x85, 0x02, 0x75, 0x04, 0x95, 0x01, 0x81, 0x03,                          // padding
    0x05, 0x01, 0x09, 0x30, 0x09, 0x31, 0x09, 0x32,                          // X, Y, Z
    0x16, 0x00, 0xf8, 0x26, 0xff, 0x07, 0x55, 0x0e, 0x65, 0x13,              // 0.01 inch
    0x75, 0x0c, 0x95, 0x03, 0xa4, 0x81, 0x02,                                //
    0x09, 0x40, 0x15, 0x00, 0x26, 0xc8, 0x00, 0x35, 0x00, 0x46, 0xe8, 0x03,  //
    0x55, 0x0c, 0x65, 0x11, 0x75, 0x08, 0x95, 0x01, 0x81, 0x02, 0xb4, 0xc0};

/// A boot mouse: X and Y are relative and have no unit.
const Bytes kMouse = {0x05, 0x01, 0x09, 0x02, 0xa1, 0x01, 0x09, 0x01, 0xa1, 0x00, 0x05, 0x09, 0x19,
                      0x01, 0x29, 0x03, 0x15, 0x00, 0x25, 0x01, 0x95, 0x03, 0x75, 0x01, 0x81, 0x02,
                      0x95, 0x01, 0x75, 0x05, 0x81, 0x01, 0x05, 0x01, 0x09, 0x30, 0x09, 0x31, 0x15,
                      0x81, 0x25, 0x7f, 0x75, 0x08, 0x95, 0x02, 0x81, 0x06, 0xc0, 0xc0};

DeviceStream read(const HidFieldMap& map, const std::vector<Bytes>& reports) {
  DeviceStream stream;
  const auto protocol = make_hid_fields(map);
  for (const Bytes& report : reports) protocol->take(report, nanoseconds{1}, stream);
  return stream;
}

std::string error_message(const Bytes& descriptor) {
  const auto map = map_report_descriptor(descriptor);
  EXPECT_FALSE(map.has_value());
  return map ? "" : map.error();
}

TEST(HidReportDescriptor, AForceAndAClockAreFoundByTheirUnits) {
  const auto map = map_report_descriptor(kProbe);
  ASSERT_TRUE(map.has_value()) << map.error();
  EXPECT_EQ(map->report_id, 0);
  ASSERT_EQ(map->fields.size(), 2U);
  EXPECT_EQ(make_hid_fields(*map)->channels(), bit_of(DeviceChannel::kForce));
  EXPECT_EQ(make_hid_fields(*map)->clock_wrap(), microseconds{std::int64_t{1} << 32});
  const auto stream = read(*map, {{7, 0, 0xe8, 0x03, 0x40, 0x42, 0x0f, 0x00},
                                  {8, 0, 0x18, 0xfc, 0xff, 0xff, 0xff, 0xff}});
  ASSERT_EQ(stream.readings.size(), 2U);
  EXPECT_DOUBLE_EQ(stream.readings[0][DeviceChannel::kForce], 1.0);
  EXPECT_EQ(stream.readings[0].device_time, microseconds{1'000'000});
  EXPECT_DOUBLE_EQ(stream.readings[1][DeviceChannel::kForce], -1.0);
  EXPECT_EQ(stream.readings[1].device_time, microseconds{0xffffffff});
}

TEST(HidReportDescriptor, EnglishUnitsAreConverted) {
  Bytes probe = kProbe;
  const std::uint8_t dynes[] = {0x66, 0x11, 0xe1};
  *(std::search(probe.begin(), probe.end(), dynes, dynes + 3) + 1) = 0x13;  // slug·inch/s²
  const auto map = map_report_descriptor(probe);
  ASSERT_TRUE(map.has_value()) << map.error();
  const auto stream = read(*map, {{7, 0, 1, 0, 0x40, 0x42, 0x0f, 0x00}});
  ASSERT_EQ(stream.readings.size(), 1U);
  EXPECT_NEAR(stream.readings[0][DeviceChannel::kForce], 37.0685, 1e-4);  // of 100
}

TEST(HidReportDescriptor, AxesAreInTheReportThatMeasures) {
  const auto map = map_report_descriptor(kStage);
  ASSERT_TRUE(map.has_value()) << map.error();
  EXPECT_EQ(map->report_id, 2);
  EXPECT_EQ(make_hid_fields(*map)->channels(),
            bit_of(DeviceChannel::kX) | bit_of(DeviceChannel::kY) | bit_of(DeviceChannel::kZ) |
                bit_of(DeviceChannel::kDepth));
  // X = 100, Y = −1, Z = 2, depth 200 of 200
  const auto stream = read(*map, {{2, 0x40, 0x06, 0xff, 0x2f, 0x00, 0xc8}, {1, 0xff}});
  ASSERT_EQ(stream.readings.size(), 1U);
  EXPECT_DOUBLE_EQ(stream.readings[0][DeviceChannel::kX], 25.4);
  EXPECT_DOUBLE_EQ(stream.readings[0][DeviceChannel::kY], -0.254);
  EXPECT_DOUBLE_EQ(stream.readings[0][DeviceChannel::kZ], 0.508);
  EXPECT_DOUBLE_EQ(stream.readings[0][DeviceChannel::kDepth], 1.0);
  EXPECT_FALSE(map_report_descriptor(kStage, 1).has_value());
  EXPECT_TRUE(map_report_descriptor(kStage, 2).has_value());
}

TEST(HidReportDescriptor, ValuesAtTheEndsAreSaturatedAndBeyondThemRefused) {
  const auto stage = map_report_descriptor(kStage);
  ASSERT_TRUE(stage.has_value());
  const auto stream = read(*stage, {{2, 0, 0, 0, 0, 0, 0xc7},  // near the end
                                    {2, 0, 0, 0, 0, 0, 0xc8},
                                    {2, 0, 0, 0, 0, 0, 0},     // no contact
                                    {2, 0, 0x80, 0, 0, 0, 1},  // X = −2048
                                    {2, 0, 0, 0, 0, 0, 0xc9}});
  ASSERT_EQ(stream.readings.size(), 4U);
  EXPECT_FALSE(stream.readings[0].saturated);
  EXPECT_TRUE(stream.readings[1].saturated);
  EXPECT_FALSE(stream.readings[2].saturated);
  EXPECT_TRUE(stream.readings[3].saturated);
  EXPECT_EQ(stream.counts.refused, 1U);
}

TEST(HidReportDescriptor, InvalidDescriptorsGetAnError) {
  EXPECT_NE(error_message(kMouse).find("no force, depth or position with a unit"),
            std::string::npos);
  EXPECT_NE(error_message({}).find("no force, depth or position"), std::string::npos);
  EXPECT_NE(error_message({0x26, 0xff}).find("ends within an item"), std::string::npos);
  EXPECT_NE(error_message({0xb4}).find("has a Pop without a Push"), std::string::npos);
  EXPECT_NE(error_message(Bytes(20, 0xa4)).find("nested too deeply"), std::string::npos);
  EXPECT_NE(error_message({0x85, 0x00}).find("out of range"), std::string::npos);
  EXPECT_NE(error_message({0x77, 0xff, 0xff, 0xff, 0xff, 0x97, 0xff, 0xff, 0xff, 0xff, 0x81, 0x02})
                .find("too long"),
            std::string::npos);
  EXPECT_NE(error_message(Bytes(5000, 0xc0)).find("too long"), std::string::npos);
}

/// Descriptors with changed, inserted and removed bytes: maps stay within the longest report.
TEST(HidReportDescriptor, DamagedDescriptorsNeverLeadBeyondAReport) {
  Random random(5);
  const std::vector<Bytes> seeds = {kProbe, kStage, kMouse};
  std::size_t mapped = 0;
  for (int round = 0; round < 100'000; ++round) {
    Bytes bytes = seeds[random.next() % seeds.size()];
    for (std::uint64_t change = 0; change < 1 + random.next() % 4; ++change) {
      const auto at = static_cast<std::ptrdiff_t>(random.next() % bytes.size());
      const auto value = static_cast<std::uint8_t>(random.next());
      if (random.next() % 4 == 0) {
        bytes.insert(bytes.begin() + at, value);
      } else {
        bytes[static_cast<std::size_t>(at)] = value;
      }
    }
    if (random.next() % 8 == 0) bytes.resize(random.next() % bytes.size());
    const auto map = map_report_descriptor(bytes);
    if (!map) continue;
    ++mapped;
    Bytes report(random.next() % 16U);
    for (auto& byte : report) byte = static_cast<std::uint8_t>(random.next());
    if (!report.empty() && map->report_id != 0) report[0] = map->report_id;
    for (const HidField& field : map->fields) {
      ASSERT_GE(field.bits, 1U);
      ASSERT_LE(field.bits, HidFieldMap::kMaxBits);
      ASSERT_LE(field.offset + field.bits, HidFieldMap::kLastBit);
    }
    for (const DeviceReading& reading : read(*map, {report}).readings) {
      ASSERT_TRUE(plausible(reading));
    }
  }
  EXPECT_GT(mapped, 10'000U);
}

}  // namespace
}  // namespace merkel
