#include "drivers/protocols/hbf1_hello.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "core/units.hpp"
#include "drivers/protocols/hbf1_frame.hpp"

namespace merkel {
namespace {

constexpr std::size_t kChannelBytes = 11;
constexpr std::uint8_t kLastKind = 9;

float read_f32(std::span<const std::uint8_t, 4> bytes) noexcept {
  return std::bit_cast<float>(read_u32(bytes));
}

}  // namespace

std::string hbf1_text(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += byte >= 0x20 && byte < 0x7F ? static_cast<char>(byte) : '?';
  }
  return text;
}

Expected<Hbf1Hello::Channel, Hbf1Hello::Error> Hbf1Hello::parse_channel(
    std::span<const std::uint8_t> entry, std::size_t number) {
  const std::uint8_t kind = entry[0];
  const std::uint8_t unit = entry[2];
  Channel channel{.channel = std::nullopt,
                  .format = static_cast<Hbf1Format>(entry[1]),
                  .scale = static_cast<double>(read_f32(entry.subspan<3, 4>())),
                  .offset = static_cast<double>(read_f32(entry.subspan<7, 4>()))};
  if (kind > kLastKind || channel.format > Hbf1Format::kFloat || !std::isfinite(channel.scale) ||
      !std::isfinite(channel.offset)) {
    return Unexpected<Error>(Error{});
  }
  if (unit > kHbf1LastUnit) {
    return Unexpected<Error>(
        Error{.sentence = "its HELLO message reports channel " + std::to_string(number) +
                          " in the unknown unit " + std::to_string(unit) +
                          ": the known ones are 0 raw, 1 N, 2 mm, 3 um and 4 degC"});
  }
  if (unit == kHbf1Micrometre) {
    channel.scale = units::mm_from_um(channel.scale);
    channel.offset = units::mm_from_um(channel.offset);
  }
  if (kind < kHbf1Kinds.size()) channel.channel = kHbf1Kinds[kind];
  return channel;
}

Expected<Hbf1Hello, Hbf1Hello::Error> Hbf1Hello::parse(std::span<const std::uint8_t> body) {
  const auto take = [&body](std::size_t count) {
    const auto head = body.first(std::min(count, body.size()));
    body = body.subspan(head.size());
    return head;
  };
  const auto head = take(4);
  if (head.size() < 4 || head[0] != 1) return Unexpected<Error>(Error{});
  const std::size_t count = head[1];
  Hbf1Hello hello;
  hello.rate_Hz_ = read_u16(head.subspan<2, 2>());
  std::array<std::string, 2> names;  // serial number, firmware
  for (std::string& name : names) {
    const auto size = take(1);
    if (size.empty()) return Unexpected<Error>(Error{});
    const auto text = take(size[0]);
    if (text.size() != size[0]) return Unexpected<Error>(Error{});
    name = hbf1_text(text);
  }
  hello.serial_number_ = std::move(names[0]);
  if (count == 0 || body.size() != count * kChannelBytes) return Unexpected<Error>(Error{});
  for (std::size_t i = 0; i < count; ++i) {
    auto channel = parse_channel(take(kChannelBytes), i + 1);
    if (!channel) return Unexpected<Error>(channel.error());
    if (channel->channel) hello.channels_ |= bit_of(*channel->channel);
    hello.layout_.push_back(*channel);
  }
  if (hello.channels_ == 0U) {
    return Unexpected<Error>(
        Error{.sentence = "its HELLO message lists no channel of force, depth or position"});
  }
  return hello;
}

std::size_t Hbf1Hello::sample_bytes() const noexcept {
  std::size_t bytes = 0;
  for (const Channel& channel : layout_) bytes += channel.bytes();
  return bytes;
}

void Hbf1Hello::read_values(std::span<const std::uint8_t> values,
                            DeviceReading& reading) const noexcept {
  for (const Channel& channel : layout_) {
    double raw = 0.0;
    switch (channel.format) {
      case Hbf1Format::kInt16: {
        const auto counts = static_cast<std::int16_t>(read_u16(values.first<2>()));
        reading.saturated = reading.saturated || counts == INT16_MAX || counts == INT16_MIN;
        raw = counts;
        break;
      }
      case Hbf1Format::kInt32:
        raw = static_cast<std::int32_t>(read_u32(values.first<4>()));
        break;
      case Hbf1Format::kFloat:
        raw = static_cast<double>(read_f32(values.first<4>()));
        break;
    }
    values = values.subspan(channel.bytes());
    if (channel.channel) reading.set(*channel.channel, raw * channel.scale + channel.offset);
  }
}

}  // namespace merkel
