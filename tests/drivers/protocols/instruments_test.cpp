#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "drivers/protocols/hid_fields.hpp"
#include "tests/drivers/protocols/protocol_harness.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

/// The error for invalid options.
std::string refusal(std::string_view name, const std::string& options) {
  const auto uri = Uri::parse("serial:x?" + options);
  UriOptions reader(*uri);
  const auto made = (*find_protocol(name))->make(reader);
  if (!made) return made.error().sentence;
  const auto done = reader.finish();
  return done ? "" : done.error().sentence;
}

TEST(CsvLines, ColumnsSeparatorsAndUnitsAreTheUsers) {
  Talk talk("csv", "columns=time_ms,-,force_gF,depth_um,seq&separator=semicolon");
  talk.take("half;a;line\r\n12;x;1000;250; 7\r\n");
  ASSERT_EQ(talk.stream.readings.size(), 1U);
  EXPECT_EQ(talk.stream.readings[0].device_time, milliseconds{12});
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kForce), 9.80665);
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kDepth), 0.25);
  talk.take("13;x;1000;250;10\n");
  EXPECT_EQ(talk.stream.counts.lost, 2U);
  talk.take("14;x;1000;250\n15;x;abc;250;11\n\n# remark\n16;x;nan;1;12\n17;x;1e30;1;13\n");
  EXPECT_EQ(talk.stream.counts.damaged, 2U);
  EXPECT_EQ(talk.stream.counts.refused, 2U);
  EXPECT_EQ(talk.stream.readings.size(), 2U);
  for (int k = 0; k < 50; ++k) talk.take("77777777");
  talk.take("\n");
  EXPECT_EQ(talk.stream.counts.damaged, 3U);
}

TEST(CsvLines, AHeaderNamesTheColumns) {
  Talk talk("csv");
  EXPECT_EQ(talk.protocol->channels(), 0U);
  talk.take("2.5\r\ntime_us,force_mN\r\n100,2500\r\n");
  EXPECT_EQ(talk.protocol->channels(), bit_of(DeviceChannel::kForce));
  ASSERT_EQ(talk.stream.readings.size(), 1U);
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kForce), 2.5);
  talk.take("time_us,force_mN\r\n9000,2500\r\n");
  EXPECT_EQ(talk.stream.counts.reboots, 0U);
  talk.take("time_us,force_mN\r\n100,2500\r\n");  // the device has restarted
  EXPECT_EQ(talk.stream.counts.reboots, 1U);
}

TEST(CsvLines, AClockThatGoesBackIsARebootUnlessItWraps) {
  Talk talk("csv", "columns=time_us,force_N");
  talk.take("x\n4294967290,1\n4,1\n1000000,1\n0,1\n10000,1\n20000,1\n30000,1\n");
  EXPECT_EQ(talk.stream.counts.reboots, 1U);
  EXPECT_EQ(talk.stream.readings.size(), 7U);
  EXPECT_TRUE(talk.stream.readings[5].rebooted);
}

TEST(CsvLines, OneWrongTimeIsNoReboot) {
  Talk talk("csv", "columns=time_us,force_N");
  talk.take("x\n1000000,1\n0,1\n1002000,1\n9000000,1\n1004000,1\n1006000,1\n1008000,1\n");
  EXPECT_EQ(talk.stream.readings.size(), 7U);
  EXPECT_EQ(talk.stream.counts.reboots, 0U);
}

TEST(CsvLines, ATimeThatCannotBeOneCostsTheTimeNotTheReading) {
  Talk talk("csv", "columns=time_s,force_N");
  talk.take(
      "x\n1.000,1\n4892832000,1\n123456789012345678901234567890,1\n-5,1\n1e400,1\n"
      "1.004,1\n");
  EXPECT_EQ(talk.stream.counts.damaged, 0U);
  ASSERT_EQ(talk.stream.readings.size(), 6U);
  EXPECT_TRUE(talk.stream.readings[1].wrong_time);  // 2125, as a time since 1970
  EXPECT_TRUE(talk.stream.readings[2].wrong_time);
  EXPECT_EQ(talk.stream.readings[3].device_time, std::chrono::seconds{-5});
  EXPECT_TRUE(talk.stream.readings[4].wrong_time);
  EXPECT_FALSE(talk.stream.readings[5].wrong_time);
  talk.take("1.2.3,1\nabc,1\n");
  EXPECT_EQ(talk.stream.counts.damaged, 2U);
}

TEST(CsvLines, BadOptionsAreNamed) {
  EXPECT_NE(refusal("csv", "columns=force_stone").find("forces are in N"), std::string::npos);
  EXPECT_NE(refusal("csv", "columns=time_h,force_N").find("s, ms or us"), std::string::npos);
  EXPECT_NE(refusal("csv", "columns=weight").find("unknown"), std::string::npos);
  EXPECT_NE(refusal("csv", "columns=time_s").find("no column is a force"), std::string::npos);
  EXPECT_NE(refusal("csv", "columns=force_N&separator=dot").find("separator"), std::string::npos);
}

TEST(Mark10, ReadsWhatTheGaugeDisplays) {
  Talk talk("mark10");
  EXPECT_EQ(talk.said(), "\rFULL\rAOUT250\r");
  talk.take("\r\n-18.78 lbF\r\n4.285 N\r\n  12 gF\r\n1.5 ozF\r\n2 kgF\r\n3 mN\r\n");
  ASSERT_EQ(talk.stream.readings.size(), 6U);
  const std::vector<double> forces = {-83.537602, 4.285, 0.1176798, 0.41702077, 19.6133, 0.003};
  for (std::size_t i = 0; i < forces.size(); ++i) {
    EXPECT_NEAR(talk.stream.readings[i][DeviceChannel::kForce], forces[i], 1e-6);
  }
  talk.take("*10\r\n");
  EXPECT_NE(talk.stream.notices.at(0).find("illegal command"), std::string::npos);
  talk.take("*22\r\n*11\r\n");
  EXPECT_NE(talk.stream.notices.at(1).find("value too large"), std::string::npos);
  EXPECT_NE(talk.stream.notices.at(2).find("not applicable"), std::string::npos);
  talk.take("4.2.8 N\r\nN\r\n12\r\n3 N 4 N x\r\n");
  EXPECT_EQ(talk.stream.counts.damaged, 4U);
  talk.take("1 stone\r\n");
  EXPECT_NE(talk.protocol->error_message().find("unknown unit \"stone\""), std::string::npos);
  talk.take("3 N 1 stone\r\n5\r\n4 N 6\r\n4 N x\r\n");  // in part
  EXPECT_EQ(talk.stream.readings.size(), 6U);
  EXPECT_EQ(talk.stream.counts.damaged, 9U);
}

TEST(Mark10, NumbersWithoutUnitTakeTheUsers) {
  Talk talk("mark10", "unit=mN&rate_hz=50");
  EXPECT_EQ(talk.said(), "\rAOUT50\r");
  talk.take("\r\n1500\r\n");
  ASSERT_EQ(talk.stream.readings.size(), 1U);
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kForce), 1.5);
  EXPECT_NE(refusal("mark10", "unit=stone").find("forces are in"), std::string::npos);
  EXPECT_NE(refusal("mark10", "rate_hz=60").find("rate_hz"), std::string::npos);
}

TEST(Mark10, ASilentGaugeIsToldToStreamAgain) {
  Talk talk("mark10");
  EXPECT_EQ(talk.poll(), "");
  talk.now += milliseconds{1100};
  EXPECT_EQ(talk.poll(), "FULL\rAOUT250\r");
}

TEST(Esm, ReadsTravelAndForceByTheirUnits) {
  Talk talk("esm");
  EXPECT_EQ(talk.poll(), "n");
  talk.now += milliseconds{7};
  talk.take("12.345 mm 4.285 N\r\n");
  ASSERT_EQ(talk.stream.readings.size(), 1U);
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kDepth), 12.345);
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kForce), 4.285);
  EXPECT_EQ(talk.now - *talk.stream.readings[0].requested, milliseconds{7});
  talk.now += milliseconds{50};
  EXPECT_EQ(talk.poll(), "n");
  talk.take("1 lbF, 0.5 in\r\n");
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kDepth), 12.7);
  EXPECT_NEAR(talk.value(DeviceChannel::kForce), 4.4482216, 1e-6);
}

TEST(Esm, AQuestionNeverAnsweredIsCountedAndAskedAgain) {
  Talk talk("esm");
  EXPECT_EQ(talk.poll(), "n");
  talk.now += milliseconds{100};
  EXPECT_EQ(talk.poll(), "");
  talk.now += milliseconds{101};
  EXPECT_EQ(talk.poll(), "n");
  EXPECT_EQ(talk.stream.counts.lost, 1U);
}

TEST(Grbl, ReportsBecomeWorkCoordinatesOnceTheOffsetIsKnown) {
  Talk talk("grbl");
  talk.take("\r\nGrbl 1.1h ['$' for help]\r\nok\r\n$10=1\r\n$13=0\r\nok\r\n");
  EXPECT_EQ(talk.poll(), "?");
  talk.take("<Idle|MPos:1.000,2.000,3.000|FS:0,0>\r\n");
  EXPECT_TRUE(talk.stream.readings.empty());
  talk.now += milliseconds{50};
  EXPECT_EQ(talk.poll(), "?");
  talk.take("<Idle|MPos:0.000,-10.000,5.000|FS:500,8000|Pn:PZ|WCO:0.000,1.551,5.664>\r\n");
  ASSERT_EQ(talk.stream.readings.size(), 1U);
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kX), 0.0);
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kY), -11.551);
  EXPECT_NEAR(talk.value(DeviceChannel::kZ), -0.664, 1e-12);
  talk.now += milliseconds{50};
  EXPECT_EQ(talk.poll(), "?");
  talk.take("<Run|WPos:7.000,8.000,9.000,1.000|FS:0,0>\r\n");
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kX), 7.0);
  EXPECT_EQ(talk.stream.counts.damaged, 0U);
  talk.take("<Run|WPos:7.000,8.000|FS:0,0>\r\n<Run|FS:0,0>\r\nnonsense\r\n");
  EXPECT_EQ(talk.stream.counts.damaged, 3U);
  const std::size_t before = talk.stream.readings.size();
  talk.take("<Run|WPos:7.000,8.000,9.000,1.000\r\nRun|WPos:7.000,8.000,9.000>\r\n");
  EXPECT_EQ(talk.stream.counts.damaged, 5U);
  EXPECT_EQ(talk.stream.readings.size(), before);
}

TEST(Grbl, InchesAreConvertedAndAResetIsNoticed) {
  Talk talk("grbl");
  talk.take("$13=1\r\n");
  static_cast<void>(talk.poll());
  talk.take("<Idle|WPos:1.000,0.000,0.000>\r\n");
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kX), 25.4);
  talk.take("Grbl 1.1h ['$' for help]\r\n");
  talk.now += milliseconds{50};
  EXPECT_EQ(talk.poll(), "?");
  talk.take("<Idle|WPos:1.000,0.000,0.000>\r\n");
  EXPECT_EQ(talk.stream.counts.reboots, 1U);
}

TEST(Grbl, NothingIsReadBeforeTheMachineHasStatedItsUnit) {
  Talk talk("grbl");
  talk.take("Grbl 1.1h ['$' for help]\r\n");  // its reset has lost the request for its settings
  EXPECT_EQ(talk.poll(), "?");
  talk.take("<Idle|WPos:1.000,0.000,0.000>\r\n");
  EXPECT_TRUE(talk.stream.readings.empty());
  EXPECT_EQ(talk.said(), "?$$\n");
  EXPECT_NE(talk.protocol->expected("").find("unit=in"), std::string::npos);
  talk.take("$13=1\r\nok\r\n");
  talk.now += milliseconds{50};
  EXPECT_EQ(talk.poll(), "?");
  talk.take("<Idle|WPos:1.000,0.000,0.000>\r\n");
  ASSERT_EQ(talk.stream.readings.size(), 1U);
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kX), 25.4);
  EXPECT_EQ(talk.protocol->expected("").find("unit=in"), std::string::npos);
}

const Bytes kOptoForceFrame = {0xAA, 0x07, 0x08, 0x0A, 0x2D, 0x6A, 0x00, 0x00,
                               0xFF, 0xF7, 0xFF, 0xFB, 0x00, 0x07, 0x05, 0x51};

TEST(OptoForce, ReadsTheCapturedFrame) {
  Talk talk("optoforce", "counts_per_N=10&rate_hz=100");
  const Bytes config = {0xAA, 0x00, 0x32, 0x03, 0x0A, 0x04, 0x01, 0x00, 0xEE};
  EXPECT_EQ(talk.stream.outgoing, config);
  talk.take(kOptoForceFrame);
  EXPECT_EQ(talk.stream.counts.bytes, kOptoForceFrame.size());
  ASSERT_EQ(talk.stream.readings.size(), 1U);
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kForceX), -0.9);
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kForceY), -0.5);
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kForceZ), 0.7);
}

// Byte 6 of a configuration: 0 removes the sensor's zero, 255 sets it.
TEST(OptoForce, KeepsTheZeroOfTheSensorUnlessAskedToChangeItAndChangesItOnce) {
  const auto zeroing = [](const std::string& options) {
    Talk talk("optoforce", "counts_per_N=10" + options);
    talk.protocol->begin(talk.now, talk.stream);  // after an unplug
    talk.protocol->end(talk.stream);
    const Bytes& sent = talk.stream.outgoing;
    return sent.size() == 27 ? Bytes{sent[6], sent[15], sent[24]} : Bytes{};
  };
  EXPECT_EQ(zeroing(""), (Bytes{1, 1, 1}));
  EXPECT_EQ(zeroing("&zero=set"), (Bytes{255, 1, 1}));
  EXPECT_EQ(zeroing("&zero=clear"), (Bytes{0, 1, 1}));
}

TEST(OptoForce, AnOverloadOfAnyAxisIsSaturationAndErrorsAreNamed) {
  Talk talk("optoforce");
  auto take = [&talk, count = 0](std::uint16_t status) mutable {
    Bytes frame = kOptoForceFrame;
    frame[5] = static_cast<std::uint8_t>(++count);
    frame[6] = static_cast<std::uint8_t>(status >> 8U);
    frame[7] = static_cast<std::uint8_t>(status & 0xFFU);
    unsigned sum = 0;
    for (std::size_t i = 0; i < 14; ++i) sum += frame[i];
    frame[14] = static_cast<std::uint8_t>(sum >> 8U);
    frame[15] = static_cast<std::uint8_t>(sum & 0xFFU);
    talk.take(frame);
    return talk.stream.readings.back().saturated;
  };
  EXPECT_FALSE(take(0));
  for (unsigned bit = 4; bit <= 9; ++bit) EXPECT_TRUE(take(static_cast<std::uint16_t>(1U << bit)));
  EXPECT_TRUE(talk.stream.notices.empty());  // the probe reports saturation
  EXPECT_FALSE(take(0x2800));                // DAQ error 1, sensor error 2
  ASSERT_EQ(talk.stream.notices.size(), 1U);
  EXPECT_NE(talk.stream.notices[0].find("DAQ error, sensor failure"), std::string::npos);
}

TEST(OptoForce, FindsItsFramesAgainAfterDamage) {
  Talk talk("optoforce");
  Bytes stream = {0x07, 0x08, 0x0A, 0x00};  // the end of a frame
  Bytes frame = kOptoForceFrame;
  const auto append = [&](std::uint8_t count, std::size_t keep) {
    frame[5] = count;
    frame[15] = static_cast<std::uint8_t>(0x51 - 0x6A + count);
    frame[14] = static_cast<std::uint8_t>(0x05 + (0x51 - 0x6A + count < 0 ? -1 : 0));
    stream.insert(stream.end(), frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(keep));
  };
  append(0x6A, 16);
  append(0x6B, 9);  // truncated: the following frame is found nevertheless
  append(0x6C, 16);
  append(0x6F, 16);
  talk.take(stream);
  EXPECT_EQ(talk.stream.readings.size(), 3U);
  EXPECT_EQ(talk.stream.counts.lost, 1U + 2U);
  EXPECT_EQ(talk.stream.counts.damaged, 1U);
}

TEST(OptoForce, EverySingleFlippedBitBehindTheHeaderIsNoticed) {
  for (std::size_t bit = 8 * 4; bit < 8 * kOptoForceFrame.size(); ++bit) {
    Talk talk("optoforce");
    talk.take(kOptoForceFrame);
    Bytes frame = kOptoForceFrame;
    frame[bit / 8] = static_cast<std::uint8_t>(frame[bit / 8] ^ (1U << (bit % 8)));
    talk.take(frame);
    EXPECT_EQ(talk.stream.readings.size(), 1U) << bit;
    EXPECT_EQ(talk.stream.counts.damaged, 1U) << bit;
  }
}

TEST(OptoForce, WantsItsCalibration) {
  EXPECT_NE(refusal("optoforce", "rate_hz=100").find("counts_per_N"), std::string::npos);
  EXPECT_NE(refusal("optoforce", "counts_per_N=10&rate_hz=250").find("1000|333|100|30|10"),
            std::string::npos);
}

TEST(Zaber, AsksForItsPosition) {
  Talk talk("zaber", "um_per_step=0.5&axis=z");
  EXPECT_EQ(talk.poll(), "/1 1 get pos\n");
  talk.now += milliseconds{3};
  talk.take("@01 1 OK IDLE -- 10000\r\n");
  ASSERT_EQ(talk.stream.readings.size(), 1U);
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kZ), 5.0);
  EXPECT_EQ(talk.now - *talk.stream.readings[0].requested, milliseconds{3});
}

TEST(Zaber, ChecksumsAlertsAndRejections) {
  Talk talk("zaber");
  talk.take("@01 0 OK IDLE -- 0:8D\r\n");
  EXPECT_EQ(talk.stream.counts.damaged, 0U);
  EXPECT_TRUE(talk.stream.readings.empty());  // no request was open
  talk.take("@01 0 OK IDLE -- 0:8E\r\n@01 1 OK WAIT -- 0\r\n@xx 1 OK IDLE -- 0\r\n");
  EXPECT_EQ(talk.stream.counts.damaged, 3U);
  talk.take("#01 0 hello \\\r\n!01 1 IDLE FF\r\n");
  EXPECT_EQ(talk.stream.counts.damaged, 3U);
  EXPECT_NE(talk.stream.notices.at(0).find("alert"), std::string::npos);
  static_cast<void>(talk.poll());
  talk.take("@01 1 RJ IDLE -- BADCOMMAND\r\n");
  EXPECT_NE(talk.stream.notices.at(1).find("BADCOMMAND"), std::string::npos);
  EXPECT_NE(refusal("zaber", "").find("um_per_step"), std::string::npos);
}

TEST(Zaber, ADeviceMayAnswerAsAWholeIfItHasOneAxis) {
  Talk talk("zaber", "um_per_step=0.5");
  static_cast<void>(talk.poll());
  talk.take("@01 0 OK IDLE -- 100 200\r\n");  // of a device with two axes
  EXPECT_TRUE(talk.stream.readings.empty());
  talk.take("@01 0 OK IDLE -- 10000\r\n");
  ASSERT_EQ(talk.stream.readings.size(), 1U);
  EXPECT_DOUBLE_EQ(talk.value(DeviceChannel::kDepth), 5.0);
  talk.now += milliseconds{100};
  static_cast<void>(talk.poll());
  talk.take("@01 0 RJ IDLE -- BADAXIS\r\n");
  EXPECT_NE(talk.stream.notices.at(0).find("BADAXIS"), std::string::npos);
}

/// A HID parser with its options, or the error.
Expected<std::unique_ptr<Protocol>, SetupError> hid(const std::string& options) {
  const auto uri = Uri::parse("hid:1:2?" + options);
  UriOptions reader(*uri);
  auto map = read_hid_fields(reader);
  if (!map) return Unexpected<SetupError>(map.error());
  return make_hid_fields(std::move(*map));
}

TEST(HidFields, ReadsBitsWhereTheMapSays) {
  const auto protocol =
      hid("report_id=3&fields=force_N:0:16:s:0.5,depth_um:20:12:u:10,seq:32:8:u,time_us:40:24:u");
  ASSERT_TRUE(protocol.has_value()) << protocol.error().sentence;
  EXPECT_EQ((*protocol)->expected(""), "reports with the id 3 of at least 9 bytes");
  EXPECT_EQ((*hid("fields=force_N:0:12:s:1"))->expected(""), "reports of at least 2 bytes");
  DeviceStream stream;
  const auto report = [&](std::vector<std::uint8_t> bytes) {
    (*protocol)->take(bytes, std::chrono::nanoseconds{5}, stream);
  };
  report({3, 0xFE, 0xFF, 0x0F, 0xAB, 7, 0x10, 0x27, 0x00});
  ASSERT_EQ(stream.readings.size(), 1U);
  EXPECT_DOUBLE_EQ(stream.readings[0][DeviceChannel::kForce], -1.0);
  EXPECT_DOUBLE_EQ(stream.readings[0][DeviceChannel::kDepth], 0xAB0 * 0.01);
  EXPECT_EQ(stream.readings[0].device_time, milliseconds{10});
  EXPECT_EQ((*protocol)->clock_wrap(), std::chrono::microseconds{1 << 24});
  report({3, 0, 0, 0, 0, 10, 0, 0, 0});
  EXPECT_EQ(stream.counts.lost, 2U);
  report({4, 0, 0, 0, 0, 11, 0, 0, 0});  // another report
  report({3, 0, 0, 0});                  // too short
  report({3, 0, 0, 0, 0, 10, 0, 0, 0});  // repeated
  EXPECT_EQ(stream.counts.readings, 2U);
  EXPECT_EQ(stream.counts.damaged, 1U);
  EXPECT_EQ(stream.counts.duplicates, 1U);
}

TEST(HidFields, ChannelsMayHaveNamesOfTheirOwn) {
  const auto protocol = hid("fields=seq:0:8:u,thumb_N:8:16:s:0.5,force_N:24:8:u:1,tip_um:32:8:u:1");
  ASSERT_TRUE(protocol.has_value()) << protocol.error().sentence;
  const auto names = (*protocol)->channel_names();
  ASSERT_EQ(names.size(), 3U);
  EXPECT_EQ(names[0].name, "thumb_N");
  EXPECT_EQ(names[0].column, 2U);
  EXPECT_EQ(names[1].name, "force_N");
  EXPECT_EQ(names[2].quantity, Quantity::kLength);
  DeviceStream stream;
  (*protocol)->take(Bytes{1, 3, 0, 7, 50}, std::chrono::nanoseconds{5}, stream);
  ASSERT_EQ(stream.readings.size(), 1U);
  EXPECT_EQ(stream.readings[0][names[0].channel], 1.5);
  EXPECT_EQ(stream.readings[0][names[1].channel], 7.0);
  EXPECT_EQ(stream.readings[0][names[2].channel], 0.05);
}

TEST(HidFields, BadMapsAreNamed) {
  for (const auto& [fields, sentence] : std::vector<std::pair<std::string, std::string>>{
           {"seq:0:8:u", "must contain a force"},
           {"force_N:0:33:s:1", "1 to 32 bits"},
           {"force_N:0:16:x:1", "must be CHANNEL_UNIT"},
           {"force_N:0:16:s:nan", "must be CHANNEL_UNIT"},
           {"force_N:0:16:s:0", "a scale other than 0"},
           {"time_us:0:16:u:-1,force_N:16:8:u:1", "time_us must have a positive scale"},
           {"force_N:0:16:s:1,force_g:16:16:s:1", "force_N and force_g are both the force"},
           {"force_N:0:8:u:1,force_N:8:8:u:1", "force_N is named twice"},
           {"time_us:0:16:u,time_ms:16:16:u,force_N:32:8:u:1", "are both the time"},
           {"seq:0:8:u,seq:8:8:u,force_N:16:8:u:1", "seq is named twice"},
           {"force_stone:0:16:s:1", "unit of force_stone is unknown"},
           {"weight_C:0:16:s:1", "channel weight_C is unknown"},
           {"time_us:0:16:s", "must be unsigned"}}) {
    const auto made = hid("fields=" + fields);
    ASSERT_FALSE(made.has_value()) << fields;
    EXPECT_NE(made.error().sentence.find(sentence), std::string::npos) << made.error().sentence;
  }
}

TEST(HidFields, RandomReportsNeverGiveAnImpossibleReading) {
  const auto protocol = hid("fields=force_kN:3:32:s:1000,depth_mm:40:9:u:1,seq:60:4:u");
  ASSERT_TRUE(protocol.has_value());
  Random random(9);
  DeviceStream stream;
  for (int round = 0; round < 20'000; ++round) {
    Bytes report(random.next() % 12U);
    for (auto& byte : report) byte = static_cast<std::uint8_t>(random.next());
    (*protocol)->take(report, std::chrono::nanoseconds{round}, stream);
  }
  EXPECT_GT(stream.counts.refused, 0U);
  EXPECT_GT(stream.counts.damaged, 0U);
  for (const DeviceReading& reading : stream.readings) ASSERT_TRUE(plausible(reading));
}

}  // namespace
}  // namespace merkel
