// What a device's text calls its values: headers that come later, JSON, labels, and frames.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/protocols/text_row.hpp"
#include "tests/drivers/protocols/protocol_harness.hpp"
#include "tests/text_has.hpp"

namespace merkel {
namespace {

/// The channel of a name, in the unit of readings.
double named_value(const Talk& talk, const std::string& name, std::size_t back = 0) {
  const DeviceReading& reading = talk.stream.readings.at(talk.stream.readings.size() - 1 - back);
  for (const ChannelName& each : talk.protocol->channel_names()) {
    if (each.name.substr(0, each.name.rfind('_')) == name) return reading[each.channel];
  }
  return -1.0;
}

TEST(LaterHeaders, TheEndOfTheSameHeaderChangesNothing) {
  Talk talk("csv");
  talk.take("time_ms,thumb_N,palm_N\n1,0.5,0.25\n");
  talk.protocol->begin(talk.now, talk.stream);  // plugged in again, within the header
  talk.take("umb_N,palm_N\n2,9\n3,0.125,0.75\n");
  EXPECT_EQ(talk.stream.counts.damaged, 1U);  // a row without its third value
  EXPECT_TRUE(talk.stream.notices.empty());
  ASSERT_EQ(talk.stream.readings.size(), 2U);
  EXPECT_EQ(named_value(talk, "thumb"), 0.125);
  EXPECT_EQ(named_value(talk, "palm"), 0.75);
}

TEST(LaterHeaders, ColumnsInAnotherOrderAndUnitKeepTheirChannels) {
  Talk talk("csv");
  talk.take("time_ms,thumb_N,palm_N\n1,0.5,0.25\n");
  const auto before = talk.protocol->channel_names();
  talk.take("time_us,note,palm_g,thumb_mN\n2000,7,100,500\n");
  EXPECT_EQ(talk.stream.counts.reboots, 0U);
  EXPECT_EQ(talk.stream.counts.damaged, 0U);
  ASSERT_EQ(talk.stream.readings.size(), 2U);
  const DeviceReading& last = talk.stream.readings.back();
  EXPECT_EQ(*last.device_time, std::chrono::milliseconds{2});
  EXPECT_DOUBLE_EQ(last[before[0].channel], 0.5);
  EXPECT_DOUBLE_EQ(last[before[1].channel], 0.1 * 9.80665);
  ASSERT_EQ(talk.stream.notices.size(), 1U);
  EXPECT_TRUE(has(talk.stream.notices[0],
                  "changed from time_ms,thumb_N,palm_N to time_us,-,palm_g,thumb_mN"))
      << talk.stream.notices[0];
  EXPECT_TRUE(talk.stream.columns_changed);
}

TEST(LaterHeaders, AColumnThatIsGoneHasNoValueUntilItIsBack) {
  Talk talk("csv");
  talk.take("thumb_N,palm_N\n0.5,0.25\n");
  const auto before = talk.protocol->channel_names();
  talk.take("palm_N,index_N\n0.75,1.5\n");
  ASSERT_EQ(talk.protocol->channel_names().size(), 2U);
  EXPECT_TRUE(std::isnan(talk.stream.readings.back()[before[0].channel]));
  EXPECT_EQ(talk.stream.readings.back()[before[1].channel], 0.75);
  EXPECT_NE(talk.protocol->channel_names()[1].channel, before[0].channel) << "another finger";
  talk.take("thumb_N,palm_N\n0.5,0.25\n");
  EXPECT_EQ(talk.stream.readings.back()[before[0].channel], 0.5);
}

TEST(LaterHeaders, TheForceOfAProbeMayGo) {
  Talk talk("csv");
  talk.take("force_N,depth_mm\n0.5,1\n");
  talk.take("depth_um,temperature\n1500,20\n");
  EXPECT_EQ(talk.value(DeviceChannel::kDepth), 1.5);
  EXPECT_TRUE(std::isnan(talk.value(DeviceChannel::kForce)));
}

TEST(LaterHeaders, AnEqualOneIsNothing) {
  Talk talk("csv");
  for (int k = 0; k < 20; ++k) {
    talk.take("time_ms,force_N\n" + std::to_string(k) + ",0.5\n");
  }
  EXPECT_EQ(talk.stream.readings.size(), 20U);
  EXPECT_EQ(talk.stream.counts.reboots, 0U);
  EXPECT_TRUE(talk.stream.notices.empty());
  // Behind one, a clock that begins anew is a restart at once.
  talk.take("time_ms,force_N\n0,0.5\n");
  EXPECT_EQ(talk.stream.counts.reboots, 1U);
}

TEST(LaterHeaders, AreObeyedBehindTheOptionColumns) {
  Talk talk("csv", "columns=time_ms,thumb_N,-,palm_N");
  talk.take("x\n1,0.5,9,0.25\n");
  EXPECT_EQ(named_value(talk, "palm"), 0.25);
  talk.take("time_ms,palm_g,thumb_N\n2,100,0.5\n");
  EXPECT_EQ(talk.stream.counts.damaged, 0U);
  EXPECT_DOUBLE_EQ(named_value(talk, "palm"), 0.1 * 9.80665);
  EXPECT_EQ(named_value(talk, "thumb"), 0.5);
  EXPECT_TRUE(has(talk.stream.notices.at(0), "its header names time_ms,palm_g,thumb_N, not "))
      << talk.stream.notices[0];
}

TEST(LaterHeaders, WithoutUnitsAndWithOtherNamesTheyMoveTheGivenColumns) {
  Talk bare("csv", "columns=time_ms,thumb_N,palm_N");
  bare.take("time,thumb,palm\n1,0.5,0.25\n");
  EXPECT_TRUE(bare.stream.notices.empty()) << bare.stream.notices[0];
  bare.take("time,palm,thumb\n2,0.25,0.5\n");
  EXPECT_EQ(named_value(bare, "thumb"), 0.5);
  EXPECT_EQ(named_value(bare, "palm"), 0.25);

  Talk renamed("csv", "columns=thumb_N,palm_N");
  renamed.take("F1 (N),F2 (N)\n0.5,0.25\n");
  EXPECT_EQ(named_value(renamed, "thumb"), 0.5);
  renamed.take("F2 (N),F1 (N)\n0.25,0.5\n");
  EXPECT_EQ(named_value(renamed, "thumb"), 0.5);
  EXPECT_EQ(named_value(renamed, "palm"), 0.25);
}

TEST(LaterHeaders, TheRestOfACutOneIsNoOther) {
  Talk talk("csv");
  talk.take("time_ms,thumb_N,palm_N\n1,0.5,0.25\n");
  talk.protocol->begin(talk.now, talk.stream);
  talk.take("umb_N,palm_N\n2,0.5,0.25\n");
  EXPECT_TRUE(talk.stream.notices.empty());
  EXPECT_EQ(talk.stream.readings.size(), 2U);
  // A line of numbers may be cut anywhere, too.
  talk.protocol->begin(talk.now, talk.stream);
  talk.take("3,0.5,0.25\n4,0.5,0.25\n");
  EXPECT_EQ(talk.stream.readings.size(), 3U);
}

TEST(LaterHeaders, ANewSeparatorIsLearned) {
  Talk talk("csv");
  talk.take("thumb_N,palm_N\n0.5,0.25\n");
  talk.take("palm_N;thumb_N\n0,75;1,5\n0,75;1,5\n0,75;1,5\n");
  EXPECT_EQ(talk.stream.readings.size(), 4U);
  EXPECT_EQ(named_value(talk, "thumb"), 1.5);
}

TEST(LaterHeaders, EndlesslyManyNamesTakeNoEndlessMemory) {
  Talk talk("csv");
  for (int k = 0; k < 3000; ++k) {
    const std::string a = "a" + std::to_string(k) + "_N";
    talk.take(a + ",b" + std::to_string(k) + "_N\n1,2\n");
  }
  EXPECT_LE(talk.stream.readings.back().named.size(), 2048U);
}

TEST(Json, ALineIsARow) {
  TextRow row;
  ASSERT_TRUE(read_json_row(
      R"({"t":0.5,"thumb":{"N":2e-1},"p_kPa":[[1,2],[3]],"ok":true,"s":"0.3 N","n":null})", row));
  EXPECT_EQ(row.names, (std::vector<std::string>{"t", "thumb_N", "p1_kPa", "p2_kPa", "p3_kPa", "ok",
                                                 "s", "n"}));
  EXPECT_EQ(row.values,
            (std::vector<std::string>{"0.5", "2e-1", "1", "2", "3", "1", "0.3 N", "nan"}));
  ASSERT_TRUE(read_json_row("[1,[2.5,3]]", row));
  EXPECT_TRUE(row.names.empty());
  EXPECT_EQ(row.values, (std::vector<std::string>{"1", "2.5", "3"}));
  for (const std::string& wrong :
       {std::string("{"), std::string("{\"a\":1}}"), std::string("{\"a\":1e999}"),
        std::string("{\"a\":\"\xff\"}"), std::string("[]"), std::string("[{\"a\":1},2]"),
        std::string(4000, '['), "[" + std::string(9, '[') + "1" + std::string(9, ']') + "]",
        std::string("[1") + std::string(6000, ',')}) {
    EXPECT_FALSE(read_json_row(wrong, row)) << wrong.substr(0, 40);
  }
}

TEST(Json, NamesStandInTheLines) {
  Talk talk("csv");
  talk.take(R"({"time_s":0.001,"thumb_N":0.5,"palm_g":100})"
            "\n");
  talk.take(R"({"palm_g":200,"time_s":0.002,"thumb_N":0.25,"battery":3.7})"
            "\n");
  talk.take(R"({"battery":3.7})"
            "\n");
  talk.take(R"({"time_s":0.003,"palm_g":null})"
            "\n");
  talk.take("{\"time_s\":0.004,\n");
  ASSERT_EQ(talk.stream.readings.size(), 3U);
  EXPECT_EQ(talk.stream.counts.damaged, 1U);
  EXPECT_EQ(*talk.stream.readings[1].device_time, std::chrono::milliseconds{2});
  EXPECT_EQ(named_value(talk, "thumb", 1), 0.25);
  EXPECT_DOUBLE_EQ(named_value(talk, "palm", 1), 0.2 * 9.80665);
  EXPECT_TRUE(std::isnan(named_value(talk, "thumb")));
  EXPECT_TRUE(std::isnan(named_value(talk, "palm")));
}

TEST(Json, AStrayLineOfItHarmsNoLinesOfNumbers) {
  Talk talk("csv", "columns=force_N");
  talk.take("{\"boot\":1}\n0.5\n{\"note\":2}\n0.25\n");
  ASSERT_EQ(talk.stream.readings.size(), 2U);
  EXPECT_EQ(talk.value(DeviceChannel::kForce), 0.25);
  Talk json("csv");
  json.take("{\"boot\":1}\nHX711 ready\n{\"force_N\":0.5}\n17\n{\"force_N\":0.25}\n");
  EXPECT_EQ(json.stream.readings.size(), 2U);
  EXPECT_EQ(json.stream.counts.damaged, 1U);
}

TEST(Json, TheOptionColumnsGivesUnits) {
  Talk bare("csv");
  for (int k = 0; k < 3; ++k) bare.take("{\"t\":0.001,\"thumb\":0.5}\n");
  EXPECT_TRUE(has(bare.protocol->error_message(), "columns=t:time_s,thumb:force_N"))
      << bare.protocol->error_message();
  // Follows the advice.
  Talk talk("csv", "columns=t:time_s,thumb:force_N");
  talk.take("{\"thumb\":0.5,\"t\":0.001}\n");
  EXPECT_EQ(talk.value(DeviceChannel::kForce), 0.5);
  EXPECT_EQ(*talk.stream.readings.back().device_time, std::chrono::milliseconds{1});
  Talk list("csv", "columns=p:taxel_kPa*3");
  list.take("{\"p\":[1,2,3]}\n");
  EXPECT_EQ(list.stream.readings.back().named, (std::vector<double>{1, 2, 3}));
}

TEST(Labels, TellWhichValueIsWhich) {
  Talk talk("csv");
  talk.take("x\nthumb_N=0.5 palm_N=0.25\nthumb_N=0.5 palm_N=0.25\nthumb_N=0.5 palm_N=0.25\n");
  ASSERT_EQ(talk.stream.readings.size(), 3U);
  talk.take("palm_N=0.75 thumb_N=1.5\n");
  EXPECT_EQ(named_value(talk, "thumb"), 1.5);
  talk.take("palm_N=0.75\nbattery=3.7\n");
  ASSERT_EQ(talk.stream.readings.size(), 5U);
  EXPECT_TRUE(std::isnan(named_value(talk, "thumb")));
  EXPECT_EQ(talk.stream.counts.damaged, 0U);
}

TEST(Labels, MayLackUnitsThatTheOptionColumnsGives) {
  Talk talk("csv", "columns=time_s,thumb_N,weight_g");
  for (int k = 0; k < 3; ++k) talk.take("x\nt=0.5, thumb=0.5, w=100\n");
  ASSERT_EQ(talk.stream.readings.size(), 3U);
  talk.take("w=200, thumb=0.25, t=0.75\n");
  EXPECT_EQ(named_value(talk, "thumb"), 0.25);
  EXPECT_DOUBLE_EQ(named_value(talk, "weight"), 0.2 * 9.80665);
  EXPECT_EQ(*talk.stream.readings.back().device_time, std::chrono::milliseconds{750});
}

TEST(Frames, SeveralLinesAreOneReading) {
  Talk talk("csv", "columns=taxel_kPa*6&frame_lines=2&separator=space");
  talk.take("3 4 5\n\n0 1 2\n3 4 5\n");
  ASSERT_EQ(talk.stream.readings.size(), 1U) << "at its last line";
  EXPECT_EQ(talk.stream.readings[0].named, (std::vector<double>{0, 1, 2, 3, 4, 5}));
  talk.take("\r\n1 1 2\r\n3 4 nan\r\n\r\nframe 3\r\n2 1 2\r\n3 4 5\r\n");
  ASSERT_EQ(talk.stream.readings.size(), 3U);
  EXPECT_TRUE(std::isnan(talk.stream.readings[1].named[5]));
  EXPECT_EQ(talk.stream.counts.damaged, 0U);
}

TEST(Frames, OneWithTooFewOrTooManyLinesIsDamaged) {
  Talk talk("csv", "columns=taxel_kPa*4&frame_lines=2&separator=space");
  talk.take("\n1 2\n\n1 2\n3 4\n5 6\n1 2\n\n1 2 \n3 4 \n\n1 2\n3\n\n");
  EXPECT_EQ(talk.stream.readings.size(), 2U);
  EXPECT_EQ(talk.stream.counts.damaged, 3U);
  EXPECT_EQ(talk.stream.readings.back().named, (std::vector<double>{1, 2, 3, 4}));
}

TEST(Frames, SomethingMustSeparateThem) {
  Talk talk("csv", "columns=taxel_kPa*4&frame_lines=2");
  for (int k = 0; k < 10; ++k) talk.take("1 2\n3 4\n");
  EXPECT_TRUE(talk.stream.readings.empty());
  EXPECT_TRUE(has(talk.protocol->error_message(), "let it print an empty line after each"));
}

}  // namespace
}  // namespace merkel
