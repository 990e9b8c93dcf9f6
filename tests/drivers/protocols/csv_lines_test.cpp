// Lines of numbers in common formats.
#include <cmath>

#include <gtest/gtest.h>

#include "drivers/printable_text.hpp"
#include "drivers/protocols/csv_text_style.hpp"
#include "drivers/protocols/protocol_makers.hpp"
#include "tests/drivers/protocols/protocol_harness.hpp"
#include "tests/text_has.hpp"

namespace merkel {
namespace {

struct Case {
  const char* options;
  const char* line;  ///< %s stands for a number that changes
  double factor;     ///< N (or mm) of that number
  DeviceChannel channel;
};

std::string lines_of(const std::string& pattern, const std::vector<std::string>& numbers) {
  std::string text;
  for (const std::string& number : numbers) {
    std::string line = pattern;
    line.replace(line.find("%s"), 2, number);
    text += line + "\r\n";
  }
  return text;
}

TEST(CsvInTheWild, EveryUsualWayToPrintANumberIsRead) {
  const std::vector<Case> cases = {
      {"", "Force: %s N", 1.0, DeviceChannel::kForce},
      {"", "%s N", 1.0, DeviceChannel::kForce},
      {"", "force=%s mN", 1e-3, DeviceChannel::kForce},
      {"", "Load %s gF", 9.80665e-3, DeviceChannel::kForce},
      {"", "Force: %s N, Travel: 1.5 mm", 1.0, DeviceChannel::kForce},
      {"", "t=12 ms; Fz: %s N", 1.0, DeviceChannel::kForceZ},
      {"", "Depth: %s mm", 1.0, DeviceChannel::kDepth},
      {"columns=force_N", "%s", 1.0, DeviceChannel::kForce},
      {"columns=force_N", "%s mN", 1e-3, DeviceChannel::kForce},
      {"columns=time_ms,force_N", "12;%s", 1.0, DeviceChannel::kForce},
      {"columns=time_ms,force_N", "12\t%s", 1.0, DeviceChannel::kForce},
      {"columns=time_ms,force_N", "12 %s", 1.0, DeviceChannel::kForce},
      {"columns=-,force_N,-&separator=semicolon", "1;%s;3", 1.0, DeviceChannel::kForce},
  };
  for (const Case& each : cases) {
    Talk talk("csv", each.options);
    talk.take("x\r\n" + lines_of(each.line, {"0.300", "0.250", "-0.125", "1e-3", "+2.5"}));
    ASSERT_EQ(talk.stream.readings.size(), 5U) << each.options << " " << each.line;
    const double wanted[] = {0.3, 0.25, -0.125, 1e-3, 2.5};
    for (std::size_t i = 0; i < 5; ++i) {
      ASSERT_TRUE(talk.stream.readings[i].has(each.channel)) << each.line;
      EXPECT_NEAR(talk.stream.readings[i][each.channel], wanted[i] * each.factor, 1e-9)
          << each.line;
    }
    EXPECT_EQ(talk.stream.counts.damaged, 0U) << each.line;
  }
}

TEST(CsvInTheWild, AFieldHasLabelNumberAndUnit) {
  const CsvField field = parse_csv_field(" Fz: -12,5e-1 mN ", true);
  EXPECT_EQ(field.label, "Fz");
  ASSERT_TRUE(field.number);
  EXPECT_DOUBLE_EQ(*field.number, -1.25);
  EXPECT_EQ(field.unit, "mN");
  EXPECT_TRUE(field.decimals);
  EXPECT_FALSE(parse_csv_field("x1-", false).number.has_value());
}

TEST(CsvInTheWild, TheSignBeforeANumberIsRead) {
  for (const std::string text :
       {"\u22120.25", "F: \u2212 0.25 N", "W-0000.25", "F_-0.25N", "ST -0.25 g", "F1 -.25"}) {
    EXPECT_EQ(parse_csv_field(text, false).number, -0.25) << text;
  }
  EXPECT_EQ(parse_csv_field("W+0012.5", false).number, 12.5);
}

TEST(CsvInTheWild, TheDecimalsOfANameAreNoNumber) {
  for (const std::string text : {"F0.25N", "v12.25", "F_0.25", "F1", "F0,25"}) {
    EXPECT_EQ(parse_csv_field(text, true).number, std::nullopt) << text;
  }
  EXPECT_EQ(parse_csv_field("v1.2 0.25 N", false).number, 0.25);
}

TEST(CsvInTheWild, BytesAndLinesWithoutEndAreCounted) {
  Talk talk("csv", "columns=force_N");
  const std::string text = "x\n1.0\n" + std::string(100'000, '7') + "\n2.0\n";
  talk.take(text);
  EXPECT_EQ(talk.stream.counts.bytes, text.size());
  EXPECT_GE(talk.stream.counts.damaged, 1U);
  EXPECT_LE(talk.stream.counts.damaged, 100'000U);
  ASSERT_EQ(talk.stream.readings.size(), 2U);
}

TEST(CsvInTheWild, DecimalCommasAreFoundByThemselves) {
  for (const auto& [options, line] :
       {std::pair("columns=time_ms,force_N", "12;%s"),
        std::pair("columns=time_ms,force_N", "12\t%s"), std::pair("columns=force_N", "%s"),
        std::pair("", "Kraft: %s N"), std::pair("columns=force_N&decimal=comma", "%s")}) {
    Talk talk("csv", options);
    talk.take("x\r\n" + lines_of(line, {"0,300", "0,250", "-0,125", "1,5"}));
    ASSERT_EQ(talk.stream.readings.size(), 4U) << options << " " << line;
    EXPECT_NEAR(talk.stream.readings[0][DeviceChannel::kForce], 0.3, 1e-12) << line;
    EXPECT_NEAR(talk.stream.readings[2][DeviceChannel::kForce], -0.125, 1e-12) << line;
  }
}

TEST(CsvInTheWild, ABareNumberIsAskedForItsName) {
  Talk talk("csv", "");
  talk.take("x\n0.300\n0.301\n0.302\n");
  EXPECT_TRUE(talk.stream.readings.empty());
  EXPECT_NE(talk.protocol->error_message().find("columns=force_N"), std::string::npos)
      << talk.protocol->error_message();
  // Follows the advice.
  Talk again("csv", "columns=force_N");
  again.take("x\n0.300\n0.301\n0.302\n");
  EXPECT_EQ(again.stream.readings.size(), 3U);
}

TEST(CsvInTheWild, AHeaderInAnyStyleNamesTheColumns) {
  for (const char* text : {"time_ms;force_N\n1;0.5\n2;0.6\n", "time_ms\tforce_N\n1\t0.5\n2\t0.6\n",
                           "time_ms, force_N\n1, 0.5\n2, 0.6\n"}) {
    Talk talk("csv", "");
    talk.take(text);
    ASSERT_EQ(talk.stream.readings.size(), 2U) << text;
    EXPECT_NEAR(talk.stream.readings[1][DeviceChannel::kForce], 0.6, 1e-12);
  }
}

// A sensor without a value must not cut off the others of its device, wherever its column is.
TEST(CsvInTheWild, TheLastFieldMayBeEmpty) {
  for (const char* const text :
       {"0,0.25,0.5\n1,0.25,\n2,0.25,\n3,0.25,0.5\n", "0;0,25;\n1;0,25;\n2;0,25;\n3;0,25;0,5\n",
        "0\t0.25\t0.5\n1\t0.25\t\n2\t0.25\t\n3\t0.25\t0.5\n"}) {
    Talk talk("csv", "columns=time_ms,thumb_N,palm_N");
    talk.stream.from_start = true;
    talk.protocol->begin({}, talk.stream);
    talk.take(text);
    ASSERT_EQ(talk.stream.readings.size(), 4U) << text;
    EXPECT_EQ(talk.stream.counts.damaged, 0U) << text;
    EXPECT_EQ(talk.stream.readings[1][named_channel(0)], 0.25) << text;
    EXPECT_TRUE(std::isnan(talk.stream.readings[1][named_channel(1)])) << text;
    EXPECT_EQ(talk.stream.readings[3][named_channel(1)], 0.5) << text;
  }
  // A separator at the end of every line is no field.
  Talk ended("csv", "columns=time_ms,thumb_N");
  ended.take("x\n0,0.25,\n1,0.25,\n2,0.25,\n");
  EXPECT_EQ(ended.stream.readings.size(), 3U);
}

TEST(CsvInTheWild, TheFirstLineCountsIfItIsWhole) {
  for (const bool whole : {false, true}) {
    Talk talk("csv", "columns=time_ms,force_N");
    talk.stream.from_start = whole;
    talk.protocol->begin({}, talk.stream);
    talk.take("1,0.5\n2,0.5\n");
    EXPECT_EQ(talk.stream.readings.size(), whole ? 2U : 1U);
  }
  Talk marked("csv", "");  // with a byte order mark
  marked.take("\xEF\xBB\xBFtime_ms,force_N\n1,0.5\n2,0.6\n");
  ASSERT_EQ(marked.stream.readings.size(), 2U);
  EXPECT_TRUE(marked.stream.readings[1].device_time);
}

// A double holds the microseconds since 1970 to a quarter of one.
TEST(CsvInTheWild, TimesAreExactInEveryUnit) {
  Talk talk("csv", "columns=time_us,force_N");
  talk.take("x\n1764200000000004.125,0.5\n");
  ASSERT_EQ(talk.stream.readings.size(), 1U);
  EXPECT_EQ(talk.stream.readings[0].device_time,
            std::chrono::nanoseconds{1'764'200'000'000'004'125});
  const auto uri = Uri::parse("serial:?columns=time_ms,time_s,force_N");
  UriOptions options(*uri);
  const auto twice = make_csv_lines(options);
  ASSERT_FALSE(twice);
  EXPECT_TRUE(has(twice.error().sentence, "time_ms and time_s are both the time"));
}

TEST(CsvInTheWild, AQuantityInTwoUnitsIsRefusedAndInAHeaderReadOnce) {
  for (const auto& [columns, sentence] : std::vector<std::pair<std::string, std::string>>{
           {"time_s,force_N,force_g", "force_N and force_g are both the force: name one"},
           {"x_mm,x_um,force_N", "x_mm and x_um are both the x"},
           {"thumb_g,palm_N,thumb_N", "thumb_g and thumb_N are both the thumb"}}) {
    const auto uri = Uri::parse("serial:?columns=" + columns);
    UriOptions options(*uri);
    const auto made = make_csv_lines(options);
    ASSERT_FALSE(made) << columns;
    EXPECT_TRUE(has(made.error().sentence, sentence)) << made.error().sentence;
  }
  for (const char* const header :
       {"time_s,time_ms,force_N,force_g", "t (s);time (ms);F (N);F (g)"}) {
    Talk talk("csv", "");
    const std::string row = has(header, ";") ? ";7;0.25;100\n" : ",7,0.25,100\n";
    talk.take(std::string(header) + "\n0.5" + row + "0.6" + row + "0.7" + row);
    ASSERT_EQ(talk.stream.readings.size(), 3U) << header;
    EXPECT_EQ(talk.stream.readings[0][DeviceChannel::kForce], 0.25) << header;
    EXPECT_EQ(talk.stream.readings[0].device_time, std::chrono::milliseconds{500}) << header;
  }
}

TEST(CsvInTheWild, LinesThatNoStyleReadsAndLinesWithoutAnEndAreToldWhatToChange) {
  Talk glued("csv", "columns=force_N");
  glued.take("x\nF0.25N\nF0.25N\nF0.25N\n");
  EXPECT_TRUE(glued.stream.readings.empty());
  EXPECT_TRUE(has(glued.protocol->expected("F0.25N"), "as in F=0.25N,D=1.5mm"))
      << glued.protocol->expected("F0.25N");
  Talk advised("csv", "");
  advised.take("F=0.25N,D=1.5mm\nF=0.25N,D=1.5mm\nF=0.25N,D=1.5mm\nF=0.25N,D=1.5mm\n");
  ASSERT_GE(advised.stream.readings.size(), 3U);
  EXPECT_EQ(advised.stream.readings[0][DeviceChannel::kForce], 0.25);
  EXPECT_EQ(advised.stream.readings[0][DeviceChannel::kDepth], 1.5);
  Talk endless("csv", "columns=time_ms,force_N");
  endless.take("1,0.252,0.253,0.25");
  EXPECT_EQ(endless.protocol->expected(endless.stream.answer),
            "a newline after each line, and 2 values in a line (time_ms,force_N)");
}

TEST(CsvInTheWild, AHeaderMayHaveUnitsInBrackets) {
  for (const char* text : {"Force (g);Depth [um]\n60;1500\n61;1500\n",
                           "note, F_g, depth_um\n9,60,1500\n9,61,1500\n"}) {
    Talk talk("csv", "");
    talk.take(text);
    ASSERT_EQ(talk.stream.readings.size(), 2U) << text;
    EXPECT_NEAR(talk.stream.readings[0][DeviceChannel::kForce], 0.588399, 1e-9);
    EXPECT_NEAR(talk.stream.readings[0][DeviceChannel::kDepth], 1.5, 1e-12);
  }
}

TEST(CsvInTheWild, ALabelMayBeAColumnOfItsOwn) {
  Talk talk("csv", "columns=-,force_g,-,depth_mm");
  talk.take("x\nF,123.4,D,0.56\nF,123.5,D,0.57\n");
  ASSERT_EQ(talk.stream.readings.size(), 2U);
  EXPECT_NEAR(talk.stream.readings[1][DeviceChannel::kDepth], 0.57, 1e-12);
  Talk stated("csv", "");
  stated.take("x\nF,123.4 g,D,0.56 mm\nF,123.4 g,D,0.56 mm\nF,123.4 g,D,0.56 mm\n");
  ASSERT_EQ(stated.stream.readings.size(), 3U);
  EXPECT_NEAR(stated.stream.readings[0][DeviceChannel::kDepth], 0.56, 1e-12);
}

TEST(CsvInTheWild, ItsRateCanBeNamed) {
  Talk talk("csv", "columns=force_N&rate_hz=80");
  EXPECT_EQ(talk.protocol->period(), std::chrono::microseconds{12'500});
}

TEST(PrintableText, NothingFromOutsideMovesTheCursor) {
  EXPECT_EQ(printable_text("a\x1b[2Jb\a\r\n\x7f"), "a?[2Jb????");
  EXPECT_EQ(printable_text("\xc2\x9b"
                           "31m"),
            "?31m");                                             // C1: control sequence introducer
  EXPECT_EQ(printable_text("\xe2\x80\xaegnp.exe"), "?gnp.exe");  // right-to-left override
  EXPECT_EQ(printable_text("\xc3"), "?");
  EXPECT_EQ(printable_text("5 \xc2\xb5m"), "5 \xc2\xb5m");
  EXPECT_EQ(printable_text(std::string(1000, 'x'), 10), "xxxxxxxxxx...");
}

}  // namespace
}  // namespace merkel
