#include "drivers/files/csv_text.hpp"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "core/math/random.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

TEST(CsvText, FieldsAreTakenWithoutTheirBlanks) {
  std::string_view rest = " a,\tb ,,c";
  EXPECT_EQ(take_field(rest), "a");
  EXPECT_EQ(take_field(rest), "b");
  EXPECT_EQ(take_field(rest), "");
  EXPECT_EQ(take_field(rest), "c");
  EXPECT_TRUE(rest.empty());
}

TEST(CsvText, NumbersAreWholeFieldsOrNothing) {
  EXPECT_EQ(parse_number("1.5"), 1.5);
  EXPECT_EQ(parse_number("+1.5e3"), 1500.0);
  EXPECT_EQ(parse_number("-.5"), -0.5);
  EXPECT_TRUE(std::isnan(*parse_number("nan")));
  EXPECT_TRUE(std::isinf(*parse_number("1e999")));
  EXPECT_EQ(parse_number("1e-999"), 0.0);
  // Also a number of more digits than are shifted.
  EXPECT_DOUBLE_EQ(*parse_number("0.25" + std::string(60, '0'), 3), 250.0);
  for (const char* text : {"", "x", "1.5mm", "1,5", "--1", "0x10", "1 2"}) {
    EXPECT_FALSE(parse_number(text)) << text;
  }
}

TEST(CsvText, SecondsAreReadToTheNanosecond) {
  EXPECT_EQ(parse_seconds("0"), nanoseconds{0});
  EXPECT_EQ(parse_seconds("1.000000001"), nanoseconds{1'000'000'001});
  EXPECT_EQ(parse_seconds("1700000000.123456789"), nanoseconds{1'700'000'000'123'456'789});
  EXPECT_EQ(parse_seconds("-0.25"), nanoseconds{-250'000'000});
  EXPECT_EQ(parse_seconds("0.0000000004"), nanoseconds{0});
  EXPECT_EQ(parse_seconds("0.0000000005"), nanoseconds{1});
  EXPECT_EQ(parse_seconds("0.00000000049"), nanoseconds{0});
  EXPECT_EQ(parse_seconds("2.5e-3"), nanoseconds{2'500'000});
  EXPECT_EQ(parse_seconds(".5"), nanoseconds{500'000'000});
  for (const char* text : {"", ".", "nan", "inf", "1e10", "4000000000", "-4e9", "9.2e9",
                           "9999999999", "99999999999", "1.5s", "1.2.3", "-"}) {
    EXPECT_FALSE(parse_seconds(text)) << text;
  }
}

TEST(CsvText, SecondsAreWrittenWithNineDecimals) {
  std::string text;
  append_seconds(text, nanoseconds{1'500'000'000});
  text += ' ';
  append_seconds(text, nanoseconds{-1});
  text += ' ';
  append_seconds(text, nanoseconds::min());
  EXPECT_EQ(text, "1.500000000 -0.000000001 -9223372036.854775808");
}

TEST(CsvText, ShiftedDecimalsReadBackToTheSameBits) {
  Random random(11);
  for (int k = 0; k < 20'000; ++k) {
    const std::uint64_t bits = random.next();
    double value = 0.0;
    std::memcpy(&value, &bits, sizeof value);
    if (!std::isfinite(value) || std::fabs(value) > 1e290 || std::fabs(value) < 1e-290) continue;
    const std::string text = shifted_decimal(value, -3);
    EXPECT_EQ(parse_number(text, 3), value) << text;
  }
  EXPECT_EQ(shifted_decimal(453.45, -3), "0.45345");
}

}  // namespace
}  // namespace merkel
