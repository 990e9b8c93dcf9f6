#include <algorithm>
#include <bit>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "drivers/protocols/hbf1_frame.hpp"
#include "drivers/protocols/protocol_table.hpp"
#include "tests/drivers/protocols/protocol_harness.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

Bytes bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

void append_f32(float value, Bytes& bytes) {
  append_u32(std::bit_cast<std::uint32_t>(value), bytes);
}

/// Numbered frames of a device with one force channel.
struct Firmware {
  std::uint16_t sequence = 0;

  Bytes frame(Hbf1Type type, std::uint32_t time_us, std::span<const std::uint8_t> body) {
    Bytes wire;
    append_hbf1_frame({.type = type, .sequence = sequence++, .time_us = time_us}, body, wire);
    return wire;
  }
  Bytes hello(std::uint32_t time_us, std::uint8_t kind = 0, std::uint8_t format = 2,
              std::uint8_t unit = 1, float scale = 1.0F, float offset = 0.0F) {
    Bytes body = {1, 1, 0xE8, 0x03, 2, 'S', '7', 1, 'f', kind, format, unit};
    append_f32(scale, body);
    append_f32(offset, body);
    return frame(Hbf1Type::kHello, time_us, body);
  }
  Bytes sample(std::uint32_t time_us, float value) {
    Bytes body = {0, 0};
    append_f32(value, body);
    return frame(Hbf1Type::kSample, time_us, body);
  }
};

/// The body of a HELLO of version 2, without its channels.
Bytes named_hello(std::uint8_t count, std::uint8_t first) {
  return {2, count, 0xE8, 0x03, 2, 'S', '7', 1, 'f', first};
}

/// Appends a channel to it: 16-bit numbers in hundredths.
void append_channel(std::uint8_t kind, std::uint8_t unit, std::string_view name, Bytes& body,
                    std::uint8_t repeats = 1) {
  body.insert(body.end(), {kind, 0, unit});
  append_f32(0.01F, body);
  append_f32(0.0F, body);
  body.push_back(repeats);
  body.push_back(static_cast<std::uint8_t>(name.size()));
  body.insert(body.end(), name.begin(), name.end());
}

std::vector<std::string> names_in(const Protocol& protocol) {
  std::vector<std::string> names;
  for (const ChannelName& channel : protocol.channel_names()) names.push_back(channel.name);
  return names;
}

TEST(Hbf1Frame, ChecksumIsTheStandardOne) { EXPECT_EQ(crc16_ccitt(bytes_of("123456789")), 0x29B1); }

TEST(Hbf1Frame, MatchesTheGoldenBytes) {
  Bytes body;
  for (const float value : {1.5F, 0.25F, -3.0F, 0.0F}) append_f32(value, body);
  Bytes wire;
  append_hbf1_frame({.type = Hbf1Type::kSample, .sequence = 0x0102, .time_us = 1'000'000}, body,
                    wire);
  const Bytes golden = {0x02, 0x11, 0x06, 0x02, 0x01, 0x40, 0x42, 0x0F, 0x01, 0x01,
                        0x03, 0xC0, 0x3F, 0x01, 0x03, 0x80, 0x3E, 0x01, 0x03, 0x40,
                        0xC0, 0x01, 0x01, 0x01, 0x03, 0x86, 0xFB, 0x00};
  EXPECT_EQ(wire, golden);
}

TEST(Hbf1Frame, RandomBodiesComeBackInAnyPortions) {
  Random random(1);
  Hbf1Decoder decoder;
  decoder.reset(false);
  for (int round = 0; round < 5000; ++round) {
    Bytes body(static_cast<std::size_t>(random.uniform() * (kHbf1LongestBody + 1)));
    const bool zeros = round % 3 == 0;
    for (auto& byte : body) {
      byte = static_cast<std::uint8_t>(zeros ? random.uniform() * 2 : 1 + random.uniform() * 255);
    }
    const Hbf1Header header{.type = static_cast<Hbf1Type>(round % 10),
                            .stream = static_cast<std::uint8_t>(round),
                            .sequence = static_cast<std::uint16_t>(round * 7),
                            .time_us = static_cast<std::uint32_t>(round) * 99991U};
    Bytes wire;
    append_hbf1_frame(header, body, wire);
    ASSERT_EQ(std::count(wire.begin(), wire.end(), 0), 1);
    std::optional<Hbf1Frame> frame;
    for (const std::uint8_t byte : wire) frame = decoder.take(byte);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->header.type, header.type);
    EXPECT_EQ(frame->header.stream, header.stream);
    EXPECT_EQ(frame->header.sequence, header.sequence);
    EXPECT_EQ(frame->header.time_us, header.time_us);
    EXPECT_TRUE(std::equal(body.begin(), body.end(), frame->body.begin(), frame->body.end()));
  }
  EXPECT_EQ(decoder.counts().damaged, 0U);
}

TEST(Hbf1Frame, EverySingleFlippedBitIsNoticed) {
  const Bytes wire = Firmware().sample(5, 1.25F);
  for (std::size_t bit = 0; bit < (wire.size() - 1) * 8; ++bit) {
    Bytes flipped = wire;
    flipped[bit / 8] = static_cast<std::uint8_t>(flipped[bit / 8] ^ (1U << (bit % 8)));
    Hbf1Decoder decoder;
    decoder.reset(false);
    for (const std::uint8_t byte : flipped) EXPECT_FALSE(decoder.take(byte)) << bit;
    EXPECT_GT(decoder.counts().damaged, 0U);
  }
}

TEST(Hbf1, HelloGivesChannelsUnitsAndScales) {
  Talk talk("hbf1");
  Firmware firmware;
  talk.take(firmware.hello(0, 4, 0, 3, 2.0F, 100.0F));  // depth, 16 bits, µm, 2 each, from 100
  EXPECT_EQ(talk.protocol->channels(), bit_of(DeviceChannel::kDepth));
  EXPECT_EQ(talk.protocol->serial_number(), "S7");
  EXPECT_EQ(talk.protocol->period(), nanoseconds{1'000'000});
  const Bytes body = {0, 0, 0x38, 0xFF};  // −200
  talk.take(firmware.frame(Hbf1Type::kSample, 1000, body));
  ASSERT_EQ(talk.stream.readings.size(), 1U);
  EXPECT_NEAR(talk.value(DeviceChannel::kDepth), -0.3, 1e-12);
  EXPECT_EQ(talk.stream.readings[0].device_time, microseconds{1000});
}

TEST(Hbf1, AReadingAtTheEndOfItsFormatOrSoReportedIsSaturated) {
  Talk talk("hbf1");
  Firmware firmware;
  talk.take(firmware.hello(0, 4, 0, 3, 2.0F, 100.0F));
  for (const Bytes& body : std::vector<Bytes>{{0, 0, 0xfe, 0x7f},
                                              {0, 0, 0xff, 0x7f},
                                              {0, 0, 0x00, 0x80},
                                              {1, 0, 1, 0},
                                              {2, 0, 1, 0}}) {
    talk.now += milliseconds{1};
    talk.take(firmware.frame(Hbf1Type::kSample, 1000, body));
  }
  ASSERT_EQ(talk.stream.readings.size(), 5U);
  EXPECT_FALSE(talk.stream.readings[0].saturated);
  for (std::size_t i = 1; i < 5; ++i) EXPECT_TRUE(talk.stream.readings[i].saturated) << i;
}

TEST(Hbf1, AReadingAtTheEndOf32BitsIsSaturated) {
  Talk talk("hbf1");
  Firmware firmware;
  talk.take(firmware.hello(0, 4, 1, 3, 1e-4F));
  for (const Bytes& body : std::vector<Bytes>{{0, 0, 0xfe, 0xff, 0xff, 0x7f},
                                              {0, 0, 0xff, 0xff, 0xff, 0x7f},
                                              {0, 0, 0x00, 0x00, 0x00, 0x80}}) {
    talk.now += milliseconds{1};
    talk.take(firmware.frame(Hbf1Type::kSample, 1000, body));
  }
  ASSERT_EQ(talk.stream.readings.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(talk.stream.readings[i].saturated, i > 0) << i;
  }
}

TEST(Hbf1, AnUnknownUnitIsNamed) {
  Talk talk("hbf1");
  talk.take(Firmware().hello(0, 0, 2, 9));
  EXPECT_NE(talk.protocol->error_message().find("unknown unit 9"), std::string::npos);
}

TEST(Hbf1, AHelloGivesNamesToManyChannelsInSeveralFrames) {
  Talk talk("hbf1");
  Firmware firmware;
  Bytes head = named_hello(5, 0);
  append_channel(0, 1, "thumb", head);
  append_channel(4, 3, "thumb", head);  // depth, in µm
  Bytes tail = named_hello(5, 2);
  append_channel(0, 1, "force", tail);
  append_channel(9, 0, "humidity", tail);  // not used
  append_channel(10, 5, "pad", tail);
  talk.take(firmware.frame(Hbf1Type::kHello, 0, tail));  // its beginning was lost
  EXPECT_TRUE(names_in(*talk.protocol).empty());
  talk.take(firmware.frame(Hbf1Type::kHello, 1, head));
  EXPECT_TRUE(names_in(*talk.protocol).empty());
  talk.take(firmware.frame(Hbf1Type::kHello, 2, tail));
  EXPECT_EQ(names_in(*talk.protocol),
            (std::vector<std::string>{"thumb_N", "thumb_mm", "force_N", "pad_kPa"}));
  EXPECT_EQ(talk.protocol->channel_names()[3].column, 5U);
  EXPECT_EQ(talk.protocol->channels(), bit_of(DeviceChannel::kForce));
  EXPECT_EQ(talk.protocol->serial_number(), "S7");
  Bytes body = {0, 0};
  for (const int count : {100, 500, 200, 7, 300}) {
    append_u16(static_cast<std::uint16_t>(count), body);
  }
  talk.take(firmware.frame(Hbf1Type::kSample, 1000, body));
  ASSERT_EQ(talk.stream.readings.size(), 1U);
  const DeviceReading& reading = talk.stream.readings[0];
  const auto channels = talk.protocol->channel_names();
  EXPECT_NEAR(reading[channels[0].channel], 1.0, 1e-6);
  EXPECT_NEAR(reading[channels[1].channel], 0.005, 1e-6);
  EXPECT_NEAR(reading[DeviceChannel::kForce], 2.0, 1e-6);
  EXPECT_NEAR(reading[channels[3].channel], 3.0, 1e-6);
  EXPECT_EQ(talk.stream.counts.damaged, 0U);
}

TEST(Hbf1, OneEntryNamesTheTaxelsOfAnArray) {
  Talk talk("hbf1");
  Bytes body = named_hello(121, 0);
  append_channel(10, 5, "taxel", body, 121);
  talk.take(Firmware().frame(Hbf1Type::kHello, 0, body));
  const auto names = names_in(*talk.protocol);
  ASSERT_EQ(names.size(), 121U) << talk.protocol->error_message();
  EXPECT_EQ(names.front(), "taxel1_kPa");
  EXPECT_EQ(names.back(), "taxel121_kPa");
}

TEST(Hbf1, AHelloThatCannotBeUsedHasItsSentence) {
  for (const auto& [kind, unit, name, repeats, sentence] :
       {std::tuple(0, 1, "th,umb", 1, "names channel 1 \"th,umb\""),
        std::tuple(0, 2, "thumb", 1, "of the kind 0, in the unit 2"),
        std::tuple(4, 2, "force", 1, "means something else"),
        std::tuple(0, 1, "", 2, "names two channels force_N"),
        std::tuple(10, 5, "", 1, "gives channel 1 no name"),
        std::tuple(9, 0, "other", 1, "lists no channel of force"),
        std::tuple(10, 5, "taxel", 122, "244 bytes, but a sample carries 242")}) {
    Talk talk("hbf1");
    Bytes body = named_hello(static_cast<std::uint8_t>(repeats), 0);
    append_channel(static_cast<std::uint8_t>(kind), static_cast<std::uint8_t>(unit), name, body,
                   static_cast<std::uint8_t>(repeats));
    talk.take(Firmware().frame(Hbf1Type::kHello, 0, body));
    EXPECT_NE(talk.protocol->error_message().find(sentence), std::string::npos)
        << sentence << ": " << talk.protocol->error_message();
    EXPECT_FALSE(talk.protocol->ready());
  }
}

// Frames with a right checksum and any content, as a faulty firmware may send them.
TEST(Hbf1, AnyHelloIsReadWithinItsBounds) {
  Random random(5);
  Bytes whole = named_hello(6, 0);
  append_channel(0, 1, "thumb", whole);
  append_channel(4, 2, "thumb", whole);
  append_channel(10, 5, "taxel", whole, 4);
  for (int round = 0; round < 20'000; ++round) {
    Talk talk("hbf1");
    Firmware firmware;
    for (int frame = 0; frame < 3; ++frame) {
      Bytes body = whole;
      body.resize(random.next() % (body.size() + 20));
      for (int flips = round % 4; flips > 0 && !body.empty(); --flips) {
        body[random.next() % body.size()] = static_cast<std::uint8_t>(random.next());
      }
      talk.take(firmware.frame(Hbf1Type::kHello, 0, body));
      body.resize(2 + random.next() % 40);
      talk.take(firmware.frame(Hbf1Type::kSample, 1000, body));
    }
    for (const DeviceReading& reading : talk.stream.readings) {
      EXPECT_LE(reading.named.size(), talk.protocol->channel_names().size());
    }
  }
}

TEST(Hbf1, TheSimulatedDeviceNamesTheColumnsOfItsTrace) {
  const auto entry = find_protocol("hbf1");
  ASSERT_TRUE(entry);
  const auto device = (*entry)->simulate(ProbeSample::kForce);
  std::vector<std::string> columns = {"temperature"};
  for (int i = 1; i <= 30; ++i) columns.push_back("finger" + std::to_string(i) + "_g");
  ASSERT_TRUE(device->set_columns(columns));
  Talk talk("hbf1");
  Bytes wire;
  device->boot(talk.now, wire);
  talk.protocol->start(talk.now, talk.stream);
  talk.take(wire);
  const auto channels = talk.protocol->channel_names();
  ASSERT_EQ(channels.size(), 31U) << talk.protocol->error_message();
  EXPECT_EQ(channels[30].name, "finger30_N");
  wire.clear();
  device->take(talk.stream.outgoing, talk.now, wire);
  std::vector<double> others(columns.size());
  others[30] = 1000.0;  // g
  device->measure({.force_mN = 250.0, .channels = ProbeSample::kForce}, others, talk.now, wire);
  talk.take(wire);
  ASSERT_EQ(talk.stream.readings.size(), 1U);
  EXPECT_NEAR(talk.value(DeviceChannel::kForce), 0.25, 1e-6);
  EXPECT_NEAR(talk.stream.readings[0][channels[30].channel], 9.80665, 1e-5);
}

TEST(Hbf1, LossIsCountedExactly) {
  Talk talk("hbf1");
  Firmware firmware;
  talk.take(firmware.hello(0));
  Random random(2);
  std::uint64_t missing = 0;
  std::uint64_t pending = 0;
  std::uint64_t sent = 0;
  for (std::uint32_t k = 1; k < 150'000; ++k) {  // its sequence numbers wrap twice
    talk.now += milliseconds{1};
    const Bytes frame = firmware.sample(k * 1000, 1.0F);
    if (random.uniform() < 0.01) {
      ++pending;
      continue;
    }
    missing += std::exchange(pending, 0U);
    talk.take(frame);
    ++sent;
  }
  EXPECT_GT(missing, 1000U);
  EXPECT_EQ(talk.stream.counts.lost, missing);
  EXPECT_EQ(talk.stream.counts.readings, sent);
  EXPECT_EQ(talk.stream.counts.damaged, 0U);
  EXPECT_EQ(talk.stream.counts.reboots, 0U);
}

TEST(Hbf1, ADamagedFrameIsOneLost) {
  Talk talk("hbf1");
  Firmware firmware;
  talk.take(firmware.hello(0));
  talk.take(firmware.sample(1000, 1.0F));
  Bytes damaged = firmware.sample(2000, 1.0F);
  damaged[12] ^= 0x10U;
  talk.take(damaged);
  talk.take(firmware.sample(3000, 1.0F));
  EXPECT_EQ(talk.stream.counts.damaged, 1U);
  EXPECT_EQ(talk.stream.counts.lost, 1U);
  EXPECT_EQ(talk.stream.counts.readings, 2U);
}

TEST(Hbf1, ARebootIsNoticedAndTheStreamAskedForAgain) {
  Talk talk("hbf1");
  Firmware firmware;
  talk.take(firmware.hello(4'000'000'000U));
  talk.protocol->start(talk.now, talk.stream);
  talk.take(firmware.sample(4'000'001'000U, 1.0F));
  talk.now += milliseconds{400};
  firmware.sequence = 0;
  talk.stream.outgoing.clear();
  talk.take(firmware.hello(300));
  EXPECT_FALSE(talk.stream.outgoing.empty());
  talk.take(firmware.sample(1300, 2.0F));
  EXPECT_EQ(talk.stream.counts.reboots, 1U);
  EXPECT_EQ(talk.stream.counts.lost, 0U);
  EXPECT_TRUE(talk.stream.readings.back().rebooted);
}

TEST(Hbf1, TheWrapOfItsClockIsNoReboot) {
  Talk talk("hbf1");
  Firmware firmware;
  talk.take(firmware.hello(0xFFFFFF00U));
  talk.take(firmware.sample(0xFFFFFFF0U, 1.0F));
  talk.now += milliseconds{1};
  talk.take(firmware.sample(0x000003D8U, 1.0F));
  EXPECT_EQ(talk.stream.counts.reboots, 0U);
}

TEST(Hbf1, AReplugWithoutRebootCountsWhatWasLostMeanwhile) {
  Talk talk("hbf1");
  Firmware firmware;
  talk.take(firmware.hello(0));
  talk.take(firmware.sample(1000, 1.0F));
  for (int k = 0; k < 3000; ++k) firmware.sample(0, 1.0F);  // no host listens
  talk.now += milliseconds{3001};
  talk.protocol->begin(talk.now, talk.stream);
  talk.take(firmware.hello(3'001'000));
  talk.take(firmware.sample(3'002'000, 1.0F));
  EXPECT_EQ(talk.stream.counts.lost, 3000U);
  EXPECT_EQ(talk.stream.counts.reboots, 0U);
}

TEST(Hbf1, SyncAnswersGiveTheFourTimes) {
  Talk talk("hbf1");
  Firmware firmware;
  talk.take(firmware.hello(0));
  talk.stream.outgoing.clear();
  const auto sent = talk.now;
  static_cast<void>(talk.protocol->poll(talk.now, talk.stream));
  Hbf1Decoder decoder;
  decoder.reset(false);
  Bytes token;
  for (const std::uint8_t byte : talk.stream.outgoing) {
    if (const auto frame = decoder.take(byte)) {
      EXPECT_EQ(frame->header.type, Hbf1Type::kSyncRequest);
      token.assign(frame->body.begin(), frame->body.end());
    }
  }
  ASSERT_EQ(token.size(), 4U);
  append_u32(700, token);
  talk.now += microseconds{900};
  talk.take(firmware.frame(Hbf1Type::kSyncResponse, 750, token));
  talk.take(firmware.frame(Hbf1Type::kSyncResponse, 760, token));  // not requested again
  ASSERT_EQ(talk.stream.exchanges.size(), 1U);
  EXPECT_EQ(talk.stream.exchanges[0].sent, sent);
  EXPECT_EQ(talk.stream.exchanges[0].received, talk.now);
  EXPECT_EQ(talk.stream.exchanges[0].device_received, microseconds{700});
  EXPECT_EQ(talk.stream.exchanges[0].device_sent, microseconds{750});
}

TEST(Hbf1, NonFiniteAndImpossibleValuesAreRefused) {
  Talk talk("hbf1");
  Firmware firmware;
  talk.take(firmware.hello(0));
  for (const float value : {std::nanf(""), HUGE_VALF, -HUGE_VALF, 1e20F}) {
    talk.take(firmware.sample(1000, value));
  }
  EXPECT_EQ(talk.stream.counts.refused, 4U);
  EXPECT_TRUE(talk.stream.readings.empty());
}

TEST(Hbf1, AnEchoIsNoticedAndNotTakenForTheDevice) {
  Talk talk("hbf1");
  Firmware firmware;
  talk.take(firmware.hello(0));
  talk.take(Bytes(talk.stream.outgoing));
  talk.take(firmware.sample(1000, 1.0F));
  EXPECT_EQ(talk.stream.counts.lost, 0U);
  EXPECT_EQ(talk.stream.counts.damaged, 0U);
  ASSERT_FALSE(talk.stream.notices.empty());
  EXPECT_NE(talk.stream.notices[0].find("echo"), std::string::npos);
}

}  // namespace
}  // namespace merkel
