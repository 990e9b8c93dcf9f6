// The firmware's header against the host's: each decodes what the other encodes.

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wconversion"
#endif
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "drivers/firmware/merkel_probe/hbf1.h"
#include "drivers/firmware/merkel_probe/pulses.h"

/// The simulated board of the sketches.
namespace arduino {

std::uint32_t now_us = 0;
std::uint32_t reading_us = 0;  ///< duration of an analogue reading
std::vector<std::uint8_t> sent;
// Arduino's names. NOLINTBEGIN(readability-identifier-naming)
constexpr int A0 = 0;
constexpr int A1 = 1;
constexpr int LOW = 0;
constexpr int OUTPUT = 1;
constexpr int INPUT_PULLUP = 2;
constexpr int CHANGE = 3;
std::array<bool, 8> pins{};
void (*on_change)() = nullptr;

inline std::uint32_t micros() { return now_us; }
inline void pinMode(int, int) {}
inline bool digitalRead(std::uint8_t pin) { return pins[pin]; }
inline void digitalWrite(std::uint8_t pin, int level) { pins[pin] = level != 0; }
inline int digitalPinToInterrupt(std::uint8_t pin) { return pin; }
inline void attachInterrupt(int, void (*handler)(), int) { on_change = handler; }
inline std::uint32_t millis() { return now_us / 1000; }
inline int analogRead(int) {
  now_us += reading_us;
  return 512;
}
struct {
  void begin(long) {}
  int available() { return 0; }
  int read() { return -1; }
  void write(std::uint8_t byte) { sent.push_back(byte); }
  void write(const std::uint8_t* bytes, std::size_t count) {
    sent.insert(sent.end(), bytes, bytes + count);
  }
} Serial;
// NOLINTEND(readability-identifier-naming)

}  // namespace arduino
namespace board {
using namespace arduino;
#include "drivers/firmware/merkel_probe/merkel_probe.ino"
}  // namespace board
namespace hand {
using namespace arduino;
#define HAND
#include "drivers/firmware/merkel_probe/merkel_probe.ino"
}  // namespace hand
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "drivers/protocols/hbf1_frame.hpp"
#include "drivers/protocols/hbf1_hello.hpp"

namespace merkel {
namespace {

TEST(Firmware, FramesAreTheHosts) {
  Random random(2);
  hbf1::Encoder encoder;
  Hbf1Decoder decoder;
  decoder.reset(false);
  for (std::uint16_t round = 0; round < 2000; ++round) {
    Bytes body(random.next() % (hbf1::kMaxBody + 1));
    for (auto& byte : body) byte = static_cast<std::uint8_t>(random.next() % 3U * 85U);
    std::uint8_t wire[260];
    const std::size_t length =
        encoder.frame(hbf1::SAMPLE, round * 77U, body.data(), body.size(), wire);
    ASSERT_LE(length, 257U);
    std::optional<Hbf1Frame> frame;
    for (std::size_t i = 0; i < length; ++i) frame = decoder.take(wire[i]);
    ASSERT_TRUE(frame) << round;
    EXPECT_EQ(frame->header.sequence, round);
    EXPECT_EQ(frame->header.time_us, round * 77U);
    EXPECT_TRUE(std::equal(body.begin(), body.end(), frame->body.begin(), frame->body.end()));
  }
}

TEST(Firmware, UnderstandsTheHostsCommands) {
  hbf1::Decoder decoder;
  const auto hears = [&](const Bytes& wire) {
    bool heard = false;
    for (const std::uint8_t byte : wire) heard = decoder.take(byte) || heard;
    return heard;
  };
  Bytes wire;
  const Bytes body = {3, 0xE8, 0x03};
  append_hbf1_frame({.type = Hbf1Type::kCommand, .sequence = 9}, body, wire);
  ASSERT_TRUE(hears(wire));
  EXPECT_EQ(decoder.type, hbf1::CMD);
  ASSERT_EQ(decoder.length, 3U);
  EXPECT_TRUE(std::equal(body.begin(), body.end(), decoder.body));
  Random random(8);
  for (int k = 0; k < 100'000; ++k) decoder.take(static_cast<std::uint8_t>(random.next() % 7U));
  EXPECT_FALSE(hears({0, 1, 2, 3, 0}));
  wire[3] ^= 4U;
  EXPECT_FALSE(hears(wire));
}

/// The frames of the board since the last call.
std::vector<std::pair<Hbf1Header, Bytes>> frames_sent() {
  std::vector<std::pair<Hbf1Header, Bytes>> frames;
  Hbf1Decoder decoder;
  decoder.reset(false);
  for (const std::uint8_t byte : std::exchange(board::sent, {})) {
    if (const auto frame = decoder.take(byte)) {
      frames.emplace_back(frame->header, Bytes(frame->body.begin(), frame->body.end()));
    }
  }
  EXPECT_EQ(decoder.counts().damaged, 0U);
  return frames;
}

std::size_t samples_sent() {
  std::size_t count = 0;
  for (const auto& [header, body] : frames_sent()) count += header.type == Hbf1Type::kSample;
  return count;
}

TEST(Firmware, ABoardTooSlowForItsRateNeverGoesSilent) {
  board::setup();
  board::streaming = true;
  board::rate_hz = 1000;
  for (const std::uint32_t reading_us : {550U, 50'000U}) {  // 10 % too slow; a hundred times
    board::reading_us = reading_us;
    board::next_us = board::now_us;
    static_cast<void>(frames_sent());
    // Long enough that a growing lag would wrap the microsecond counter.
    const int loops = reading_us > 1000 ? 60'000 : 20'000;
    for (int k = 0; k < loops; ++k) {
      board::loop();
      ASSERT_LE(static_cast<std::int32_t>(board::now_us - board::next_us),
                static_cast<std::int32_t>(2 * reading_us + 1000));
    }
    EXPECT_EQ(samples_sent(), static_cast<std::size_t>(loops)) << reading_us;
  }
}

TEST(Firmware, AFastBoardKeepsItsRate) {
  board::streaming = true;
  board::rate_hz = 1000;
  board::reading_us = 5;
  board::next_us = board::now_us;
  static_cast<void>(frames_sent());
  const std::uint32_t begin = board::now_us;
  while (board::now_us - begin < 1'000'000) {
    board::loop();
    board::now_us += 7;
  }
  EXPECT_NEAR(static_cast<double>(samples_sent()), 1000.0, 1.0);
}

struct ReportedEdge {
  std::uint32_t time_us;
  std::uint16_t line;
  bool high;
  friend bool operator==(const ReportedEdge&, const ReportedEdge&) = default;
};

/// The edges that the board reports, each checked against its pins by `loops` of 7 µs.
std::vector<ReportedEdge> edges_of_run(std::uint32_t length_us, std::vector<ReportedEdge>& pin) {
  board::now_us += 12'345;
  const Bytes start = {static_cast<std::uint8_t>(Hbf1Command::kStart)};
  Bytes wire;
  append_hbf1_frame({.type = Hbf1Type::kCommand}, start, wire);
  for (const std::uint8_t byte : wire) {
    if (board::decoder.take(byte)) board::obey(board::now_us);
  }
  static_cast<void>(frames_sent());
  std::vector<ReportedEdge> edges;
  bool level = board::pins[board::SYNC_OUT];
  const std::uint32_t begin = board::now_us;
  while (board::now_us - begin < length_us) {
    if (board::now_us % 50'000 < 7) {
      board::pins[board::SYNC_IN] = !board::pins[board::SYNC_IN];
      pin.push_back({board::now_us, 2, board::pins[board::SYNC_IN]});
      board::on_change();
    }
    board::loop();
    if (board::pins[board::SYNC_OUT] != level) {
      level = board::pins[board::SYNC_OUT];
      pin.push_back({board::now_us, 1, level});
    }
    board::now_us += 7;
  }
  for (const auto& [header, body] : frames_sent()) {
    if (header.type != Hbf1Type::kEvent) continue;
    EXPECT_EQ(body.size(), 6U);
    EXPECT_EQ(read_u16(std::span(body).first<2>()), kHbf1Edge);
    edges.push_back({header.time_us, read_u16(std::span(body).subspan<2, 2>()),
                     read_u16(std::span(body).subspan<4, 2>()) == 1});
  }
  const auto before = [](const ReportedEdge& a, const ReportedEdge& b) {
    return std::pair(a.time_us, a.line) < std::pair(b.time_us, b.line);
  };
  std::sort(edges.begin(), edges.end(), before);
  std::sort(pin.begin(), pin.end(), before);
  return edges;
}

TEST(Firmware, ReportsEveryEdgeOfItsPulsesAndOfItsInputWithItsTime) {
  board::setup();
  board::rate_hz = 1000;
  board::reading_us = 0;
  std::vector<ReportedEdge> pin;
  const auto edges = edges_of_run(20'000'000, pin);
  EXPECT_EQ(edges, pin);
  std::vector<std::uint32_t> out;
  for (const ReportedEdge& edge : edges) {
    if (edge.line != 1) continue;
    EXPECT_EQ(edge.high, out.size() % 2 == 0);
    out.push_back(edge.time_us);
  }
  ASSERT_GT(out.size(), 60U);  // about 3.4 pulses a second
  for (std::size_t i = 1; i < out.size(); ++i) {
    const std::uint32_t length_us = out[i] - out[i - 1];
    EXPECT_GE(length_us, i % 2 == 1 ? 1000U : 60'000U);
    EXPECT_LE(length_us, i % 2 == 1 ? 20'014U : 500'014U);
  }
  // Another run has other pulses.
  std::vector<ReportedEdge> again;
  const auto others = edges_of_run(2'000'000, again);
  ASSERT_GT(others.size(), 4U);
  EXPECT_NE(others[2].time_us - others[0].time_us, edges[2].time_us - edges[0].time_us);
}

TEST(Firmware, ASerialNumberOfAnyLengthFits) {
  for (const std::size_t length :
       {std::size_t{0}, std::size_t{64}, std::size_t{79}, std::size_t{300}}) {
    const std::string number(length, 'n');
    board::serial_number = number.c_str();
    static_cast<void>(frames_sent());
    board::hello();
    const auto frames = frames_sent();
    ASSERT_EQ(frames.size(), 1U) << length;
    EXPECT_EQ(frames[0].first.type, Hbf1Type::kHello);
    const Bytes& body = frames[0].second;
    const std::size_t said = std::min<std::size_t>(length, 64);
    ASSERT_GT(body.size(), 5 + said);
    EXPECT_EQ(body[4], said);
    EXPECT_EQ(std::string(body.begin() + 5, body.begin() + 5 + static_cast<std::ptrdiff_t>(said)),
              number.substr(0, said));
  }
  board::serial_number = "PROBE-001";
}

TEST(Firmware, AHandNamesItsChannels) {
  static_cast<void>(frames_sent());
  hand::hello();
  hand::streaming = true;
  hand::next_us = board::now_us;
  hand::loop();
  Hbf1Hello hello;
  const auto frames = frames_sent();
  ASSERT_GE(frames.size(), 2U);
  for (const auto& [header, body] : frames) {
    if (header.type != Hbf1Type::kHello) continue;
    const auto whole = hello.take(body);
    ASSERT_TRUE(whole) << whole.error().sentence;
  }
  std::string names;
  for (const ChannelName& channel : hello.names()) names += channel.name + " ";
  EXPECT_EQ(names, "thumb_N index_N middle_N ring_N little_N palm_N ");
  EXPECT_EQ(frames.back().second.size(), kHbf1StatusBytes + hello.sample_bytes());
}

TEST(Firmware, AListOfChannelsOfAnyLengthIsSentWhole) {
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < 40; ++i) {
    texts.push_back("finger" + std::to_string(i) + std::string(i, '-'));
  }
  for (const std::size_t count : {std::size_t{1}, std::size_t{9}, std::size_t{40}}) {
    std::vector<hbf1::Channel> channels;
    for (std::size_t i = 0; i < count; ++i) {
      channels.push_back(
          {hbf1::FORCE, hbf1::INT16, hbf1::NEWTON, 0.01F, 0.0F, 1, texts[i].c_str()});
    }
    channels.push_back({hbf1::PRESSURE, hbf1::INT16, hbf1::KILOPASCAL, 0.01F, 0.0F, 80, "taxel"});
    const std::string serial_number(64, 'n');
    hbf1::Hello list(serial_number.c_str(), "f", 1000, channels.data(), channels.size());
    Hbf1Hello hello;
    bool complete = false;
    std::uint8_t body[hbf1::kMaxBody];
    while (const std::size_t length = list.next(body)) {
      EXPECT_FALSE(complete);
      ASSERT_LE(length, sizeof body);
      const auto whole = hello.take(std::span(body).first(length));
      ASSERT_TRUE(whole) << whole.error().sentence;
      complete = *whole;
    }
    EXPECT_TRUE(complete) << count;
    ASSERT_EQ(hello.names().size(), count + 80);
    EXPECT_EQ(hello.names()[count - 1].name, texts[count - 1] + "_N");
    EXPECT_EQ(hello.names().back().name, "taxel80_kPa");
  }
}

}  // namespace
}  // namespace merkel
