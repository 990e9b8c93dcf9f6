#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// The type of an HBF1 frame. Below 8: from the device; from 8: to the device.
enum class Hbf1Type : std::uint8_t {
  kHello = 0,
  kSample = 1,
  kEvent = 2,
  kText = 3,
  kSyncResponse = 4,
  kAcknowledge = 5,
  kCommand = 8,
  kSyncRequest = 9,
};

/// Code of an event with an edge of a sync line: its argument is the line, from 1, and bit 16 is
/// the level from here on.
inline constexpr std::uint16_t kHbf1Edge = 1;

/// Operations of a command frame.
enum class Hbf1Command : std::uint8_t { kStart = 1, kStop = 2, kRate = 3, kTare = 4, kHello = 5 };

/// The header of every frame; 8 bytes on the wire, little-endian.
struct Hbf1Header {
  Hbf1Type type = Hbf1Type::kSample;
  std::uint8_t stream = 0;
  std::uint16_t sequence = 0;  ///< per direction; increases with every frame of any type
  std::uint32_t time_us = 0;   ///< device clock at the latch; wraps after 71.6 minutes
};

/// A received frame. The body is valid until the decoder takes the next byte.
struct Hbf1Frame {
  Hbf1Header header;
  std::span<const std::uint8_t> body;
};

inline constexpr std::uint8_t kHbf1Version = 1;
inline constexpr std::size_t kHbf1LongestBody = 244;  ///< header, body and CRC are ≤ 254 bytes
inline constexpr std::size_t kHbf1StatusBytes = 2;    ///< of a sample, before its values

/// CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, not reflected; "123456789" gives 0x29B1.
[[nodiscard]] std::uint16_t crc16_ccitt(std::span<const std::uint8_t> bytes) noexcept;

/// Appends COBS(header | body | CRC) and the final 0.
/// \param body  at most kHbf1LongestBody bytes
void append_hbf1_frame(const Hbf1Header& header, std::span<const std::uint8_t> body, Bytes& wire);

/// Little-endian numbers in the bodies of frames.
[[nodiscard]] std::uint16_t read_u16(std::span<const std::uint8_t, 2> bytes) noexcept;
[[nodiscard]] std::uint32_t read_u32(std::span<const std::uint8_t, 4> bytes) noexcept;
void append_u16(std::uint16_t number, Bytes& bytes);
void append_u32(std::uint32_t number, Bytes& bytes);

/// Finds frames in a stream of bytes. Every 0 ends a frame, so it resynchronises after errors.
class Hbf1Decoder {
 public:
  struct Counts {
    std::uint64_t frames = 0;
    std::uint64_t damaged = 0;  ///< too long or too short, not COBS, or with a wrong CRC
  };

  /// Drops an unfinished frame. \param partial  the next bytes may be the end of a frame; do not
  /// count it as damaged
  void reset(bool partial) noexcept;
  /// The frame that a byte completes, if it is complete and correct.
  [[nodiscard]] std::optional<Hbf1Frame> take(std::uint8_t byte) noexcept;
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  [[nodiscard]] std::optional<Hbf1Frame> finish() noexcept;

  std::array<std::uint8_t, 256> wire_{};
  std::array<std::uint8_t, 256> frame_{};
  std::size_t length_ = 0;
  bool too_long_ = false;
  bool partial_ = true;
  Counts counts_;
};

}  // namespace merkel
