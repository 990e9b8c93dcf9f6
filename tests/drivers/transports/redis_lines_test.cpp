#include "drivers/transports/redis_lines.hpp"

#include <array>
#include <cstdint>
#include <cstring>
#include <string>

#include <gtest/gtest.h>

namespace merkel {
namespace {

std::string bytes_of(std::int64_t value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

std::string text_of(RedisLines& lines) {
  std::string text;
  std::array<std::uint8_t, 7> part{};
  while (const std::size_t count = lines.lines().take(part))
    text.append(part.begin(), part.begin() + count);
  return text;
}

TEST(RedisLines, AnEntryIsALineAtItsTime) {
  RedisLines lines({});
  const RedisEntry entry = {{"time_ns", "1500000001"}, {"force_N", "0.25"}, {"note", "hello"}};
  lines.choose_fields(entry);
  lines.add(entry);
  lines.add({{"ts", bytes_of(2'000'000'000)}});
  lines.add({{"ts", bytes_of(2'000'000'000)}, {"force_N", "0.5"}});
  EXPECT_EQ(text_of(lines), "1.500000001,0,0.25\n2.000000000,1,0.5\n");
}

TEST(RedisLines, LostEntriesLeaveAGapInTheNumbersUnlessAFieldIsTheNumber) {
  RedisLines lines(*parse_redis_fields("force_N"));
  lines.add({{"force_N", bytes_of(0) + bytes_of(0)}});
  lines.skip(3);
  lines.add({{"force_N", "1"}});
  EXPECT_EQ(text_of(lines), "nan,0,0\nnan,1,0\nnan,8,1\n");
  EXPECT_EQ(lines.columns(), "time_s,seq,force_N");
  RedisLines own(*parse_redis_fields("force_N,n:seq"));
  own.add({{"force_N", "1"}, {"n", "7"}});
  EXPECT_EQ(text_of(own), "nan,1,7\n");
  EXPECT_EQ(own.columns(), "time_s,force_N,seq");
}

TEST(RedisLines, FieldsInVoltsAreChosenWithTheirFactor) {
  const RedisEntry entry = {{"ts", "1764200000000000001"}, {"force_V", "0.25"}};
  RedisLines lines({});
  lines.choose_fields(entry);
  EXPECT_TRUE(lines.fields().empty());
  UnitFactors factors;
  EXPECT_EQ(factors.add("force_N_per_V", 2.0), "");
  lines.choose_fields(entry, factors);
  ASSERT_EQ(lines.fields().size(), 1U);
  lines.add(entry);
  EXPECT_EQ(text_of(lines), "1764200000.000000001,0,0.25\n");
}

TEST(RedisLines, ALabelIsNoNumberHoweverLongItIs) {
  for (const char* const label :
       {R"({"merkel_time_ns":7})", R"({"merkel_time_ns":4598603525947})", "{}", R"({"i":10})"}) {
    RedisLines lines({});
    const RedisEntry entry = {{"time_ns", "2500000000"}, {"force_N", "0.5"}, {"sync", label}};
    lines.choose_fields(entry);
    ASSERT_EQ(lines.fields().size(), 1U) << label;
    lines.add(entry);
    EXPECT_EQ(text_of(lines), "2.500000000,0,0.5\n") << label;
  }
  // A sync line of a device is one.
  RedisLines lines({});
  lines.choose_fields({{"force_N", "0.5"}, {"sync", "1"}});
  EXPECT_EQ(lines.fields().size(), 2U);
}

TEST(RedisLines, AllBytesOfAMeasuredNumberAreRead) {
  const std::string bytes = "ample r?";  // 0.0044…
  RedisLines lines({});
  const RedisEntry entry = {{"time_ns", "0"}, {"force_N", bytes}};
  lines.choose_fields(entry);
  lines.add(entry);
  double force_N = 0.0;
  std::memcpy(&force_N, bytes.data(), sizeof force_N);
  EXPECT_GT(force_N, 0.001);
  EXPECT_LT(force_N, 1.0);
  EXPECT_EQ(std::stod(text_of(lines).substr(14)), force_N);
}

TEST(RedisLines, NumbersOfAnEntryAreSpreadSinceTheEntryBefore) {
  RedisLines lines(*parse_redis_fields("samples:force_N:int16"));
  const std::string two("\x01\x00\x02\x00", 4);
  lines.add({{"ts", bytes_of(1'000'000'000)}, {"samples", two}});
  lines.add({{"ts", bytes_of(2'000'000'000)}, {"samples", two}});
  EXPECT_EQ(text_of(lines), "1.000000000,0,1\n1.000000000,1,2\n1.500000000,2,1\n2.000000000,3,2\n");
}

TEST(RedisLines, TimesThatCannotBeAreNotKnown) {
  RedisLines lines(*parse_redis_fields("force_N"));
  for (const std::int64_t time : {INT64_MIN, INT64_MAX}) {
    lines.add({{"ts", bytes_of(time)}, {"force_N", "1"}});
  }
  lines.add({{"ts", "-1e19"}, {"force_N", "1"}});
  EXPECT_EQ(text_of(lines), "nan,0,1\nnan,1,1\nnan,2,1\n");
}

TEST(RedisLines, AFieldOfTheWrongLengthHasNoNumbers) {
  RedisLines lines(*parse_redis_fields("force_N:force_N:float64,depth_mm"));
  lines.add({{"ts", "1000"}, {"force_N", "1234567"}, {"depth_mm", "0.5"}});
  lines.add({{"ts", "2000"}, {"force_N", ""}});
  EXPECT_EQ(text_of(lines), "0.000001000,0,nan,0.5\n");
}

}  // namespace
}  // namespace merkel
