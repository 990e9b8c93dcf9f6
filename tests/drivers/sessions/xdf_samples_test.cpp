#include "drivers/sessions/xdf_samples.hpp"

#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/sessions/session_items.hpp"

namespace merkel {
namespace {

template <class Value>
std::string bytes_of(const Value& value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

std::string stamp(double time_s) { return "\x08" + bytes_of(time_s); }
const std::string kNoStamp(1, '\0');

/// A chunk of two samples: 2.5 s with two numbers, then two numbers without a stamp.
std::string two_samples() {
  return "\x01\x02" + stamp(2.5) + bytes_of(std::int32_t{7}) + bytes_of(std::int32_t{-1}) +
         kNoStamp + bytes_of(std::int32_t{8}) + bytes_of(std::int32_t{9});
}

constexpr XdfForm kTwoNumbers{.channels = 2, .value_bytes = 4};

TEST(XdfSamples, AreTakenWithTheirStamps) {
  std::vector<std::optional<double>> stamps;
  std::string values;
  EXPECT_TRUE(for_each_xdf_sample(two_samples(), kTwoNumbers,
                                  [&](std::optional<double> stamp_s, XdfRow row) {
                                    stamps.push_back(stamp_s);
                                    values += row[0];
                                    return row.size() == 1;
                                  }));
  EXPECT_EQ(stamps, (std::vector<std::optional<double>>{2.5, std::nullopt}));
  EXPECT_EQ(values, bytes_of(std::array{7, -1, 8, 9}));
}

TEST(XdfSamples, OtherBytesAreRefused) {
  const auto take = [](std::optional<double> /*stamp_s*/, XdfRow /*row*/) { return true; };
  const std::string good = two_samples();
  for (std::size_t length = 0; length < good.size(); ++length) {
    EXPECT_FALSE(for_each_xdf_sample(good.substr(0, length), kTwoNumbers, take)) << length;
  }
  EXPECT_FALSE(for_each_xdf_sample(good + '\0', kTwoNumbers, take));
  EXPECT_TRUE(for_each_xdf_sample(std::string("\x01\0", 2), kTwoNumbers, take));
  EXPECT_FALSE(for_each_xdf_sample(std::string("\x01\0x", 3), kTwoNumbers, take));
  std::string wrong_stamp = good;
  wrong_stamp[2] = '\x04';
  EXPECT_FALSE(for_each_xdf_sample(wrong_stamp, kTwoNumbers, take));
  // More samples or texts than there are bytes.
  EXPECT_FALSE(for_each_xdf_sample("\x04\xff\xff\xff\xff" + good, kTwoNumbers, take));
  EXPECT_FALSE(for_each_xdf_sample(good, {.channels = 1U << 31U, .value_bytes = 0}, take));
  EXPECT_FALSE(for_each_xdf_sample(good, kTwoNumbers, [](auto, auto) { return false; }));
}

TEST(XdfSamples, AMarkHasATimeAndALabel) {
  SessionChunk chunk;
  const std::string label(
      "\x01\x05"
      "touch",
      7);
  EXPECT_TRUE(decode_marks("\x01\x01" + stamp(1.5) + label, chunk));
  ASSERT_EQ(chunk.marks.size(), 1U);
  EXPECT_EQ(chunk.marks[0].time, std::chrono::milliseconds{1500});
  EXPECT_EQ(chunk.marks[0].label, "touch");
  EXPECT_FALSE(decode_marks("\x01\x01" + kNoStamp + label, chunk));
  EXPECT_FALSE(decode_marks("\x01\x01" + stamp(5e9) + label, chunk));
}

}  // namespace
}  // namespace merkel
