#include "drivers/protocols/hbf1_frame.hpp"

namespace merkel {
namespace {

constexpr std::size_t kHeaderBytes = 8;
constexpr std::size_t kCrcBytes = 2;

/// Consistent Overhead Byte Stuffing. The result has no 0 and is one byte longer per 254 bytes.
void append_cobs(std::span<const std::uint8_t> bytes, Bytes& out) {
  std::size_t code = out.size();
  out.push_back(1);
  for (const std::uint8_t byte : bytes) {
    if (byte != 0) {
      out.push_back(byte);
      if (++out[code] != 0xFF) continue;
    }
    code = out.size();
    out.push_back(1);
  }
}

/// The inverse. Empty if the bytes are not valid COBS.
std::optional<std::size_t> decode_cobs(std::span<const std::uint8_t> in,
                                       std::span<std::uint8_t> out) noexcept {
  std::size_t read = 0;
  std::size_t written = 0;
  while (read < in.size()) {
    const std::size_t code = in[read++];
    if (code == 0 || read + code - 1 > in.size()) return std::nullopt;
    for (std::size_t i = 1; i < code; ++i) out[written++] = in[read++];
    if (code != 0xFF && read < in.size()) out[written++] = 0;
  }
  return written;
}

}  // namespace

std::uint16_t crc16_ccitt(std::span<const std::uint8_t> bytes) noexcept {
  constexpr std::uint32_t kPolynomial = 0x1021;
  std::uint32_t crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= static_cast<std::uint32_t>(byte) << 8U;
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc & 0x8000U) != 0U ? (crc << 1U) ^ kPolynomial : crc << 1U;
    }
  }
  return static_cast<std::uint16_t>(crc);
}

std::uint16_t read_u16(std::span<const std::uint8_t, 2> bytes) noexcept {
  return static_cast<std::uint16_t>(bytes[0] | (bytes[1] << 8));
}

std::uint32_t read_u32(std::span<const std::uint8_t, 4> bytes) noexcept {
  return static_cast<std::uint32_t>(bytes[0]) | static_cast<std::uint32_t>(bytes[1]) << 8U |
         static_cast<std::uint32_t>(bytes[2]) << 16U | static_cast<std::uint32_t>(bytes[3]) << 24U;
}

void append_u16(std::uint16_t number, Bytes& bytes) {
  bytes.push_back(static_cast<std::uint8_t>(number & 0xFFU));
  bytes.push_back(static_cast<std::uint8_t>(number >> 8U));
}

void append_u32(std::uint32_t number, Bytes& bytes) {
  append_u16(static_cast<std::uint16_t>(number & 0xFFFFU), bytes);
  append_u16(static_cast<std::uint16_t>(number >> 16U), bytes);
}

void append_hbf1_frame(const Hbf1Header& header, std::span<const std::uint8_t> body, Bytes& wire) {
  Bytes frame;
  frame.reserve(kHeaderBytes + body.size() + kCrcBytes);
  frame.push_back(
      static_cast<std::uint8_t>(kHbf1Version << 4U | static_cast<std::uint8_t>(header.type)));
  frame.push_back(header.stream);
  append_u16(header.sequence, frame);
  append_u32(header.time_us, frame);
  frame.insert(frame.end(), body.begin(), body.end());
  append_u16(crc16_ccitt(frame), frame);
  append_cobs(frame, wire);
  wire.push_back(0);
}

void Hbf1Decoder::reset(bool partial) noexcept {
  length_ = 0;
  too_long_ = false;
  partial_ = partial;
}

std::optional<Hbf1Frame> Hbf1Decoder::take(std::uint8_t byte) noexcept {
  if (byte != 0) {
    if (length_ < wire_.size()) {
      wire_[length_++] = byte;
    } else {
      too_long_ = true;
    }
    return std::nullopt;
  }
  if (length_ == 0) {
    partial_ = false;
    return std::nullopt;
  }
  const auto frame = finish();
  if (!frame && !partial_) ++counts_.damaged;
  if (frame) ++counts_.frames;
  reset(false);
  return frame;
}

std::optional<Hbf1Frame> Hbf1Decoder::finish() noexcept {
  if (too_long_) return std::nullopt;
  const auto length = decode_cobs(std::span(wire_).first(length_), frame_);
  if (!length || *length < kHeaderBytes + kCrcBytes) return std::nullopt;
  const std::size_t end = *length - kCrcBytes;
  const auto bytes = std::span<const std::uint8_t>(frame_);
  if (crc16_ccitt(bytes.first(end)) != (bytes[end] | bytes[end + 1] << 8)) return std::nullopt;
  if (bytes[0] >> 4U != kHbf1Version) return std::nullopt;
  return Hbf1Frame{.header = {.type = static_cast<Hbf1Type>(bytes[0] & 0xFU),
                              .stream = bytes[1],
                              .sequence = read_u16(bytes.subspan<2, 2>()),
                              .time_us = read_u32(bytes.subspan<4, 4>())},
                   .body = bytes.subspan(kHeaderBytes, end - kHeaderBytes)};
}

}  // namespace merkel
