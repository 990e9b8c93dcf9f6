// The firmware's own file against the host's: what one encodes the other decodes.

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wconversion"
#endif
#include "drivers/firmware/merkel_probe/hbf1.h"
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "drivers/protocols/hbf1_frame.hpp"

namespace merkel {
namespace {

TEST(Firmware, FramesAreTheHosts) {
  Random random(2);
  hbf1::Encoder encoder;
  Hbf1Decoder decoder;
  decoder.reset(false);
  for (std::uint16_t round = 0; round < 2000; ++round) {
    Bytes body(random.next() % (hbf1::kLongestBody + 1));
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

}  // namespace
}  // namespace merkel
