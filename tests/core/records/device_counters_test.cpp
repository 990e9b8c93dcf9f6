#include "core/records/device_counters.hpp"

#include <set>
#include <string_view>

#include <gtest/gtest.h>

#include "core/records/run_counters.hpp"

namespace merkel {
namespace {

TEST(DeviceCounters, EachRowMergesByItsRule) {
  DeviceCounters one;
  DeviceCounters other;
  std::uint64_t value = 3;
  for (const auto& field : kDeviceCounterFields<>) {
    one.*field.cell = value;
    other.*field.cell = value + 5;
    value += 7;
  }
  DeviceCounters all = one;
  merge(all, other);
  for (const auto& field : kDeviceCounterFields<>) {
    const std::uint64_t expected =
        field.name == "device_largest_batch" ? other.*field.cell : 2 * (one.*field.cell) + 5;
    EXPECT_EQ(all.*field.cell, expected) << field.name;
  }
  merge(other, one);
  EXPECT_EQ(all, other);
}

TEST(RunCounters, ContainThoseOfTheDevicesUnderNamesOfTheirOwn) {
  RunCounters counters;
  counters.refused = 17;
  std::set<std::string_view> names;
  std::uint64_t found = 0;
  for (const auto& field : kRunCounterFields<>) {
    EXPECT_TRUE(names.insert(field.name).second) << field.name;
    if (field.name == "device_refused") found = counters.*field.cell;
  }
  EXPECT_EQ(found, 17U);
  for (const auto& field : kDeviceCounterFields<>) {
    EXPECT_TRUE(names.contains(field.name)) << field.name;
  }
}

}  // namespace
}  // namespace merkel
