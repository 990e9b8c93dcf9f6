// HBF1 frames for a microcontroller: COBS(header | body | CRC) and a 0. No heap, no library.
//
// The layout is that of drivers/protocols/hbf1_frame.hpp; a test encodes with this file and decodes
// with that one. Needs a little-endian core (all Arduino and Teensy boards).
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>

namespace hbf1 {

enum Type : uint8_t { HELLO = 0, SAMPLE = 1, EVENT = 2, TEXT = 3, SYNC_RSP = 4, ACK = 5, CMD = 8, SYNC_REQ = 9 };
enum Command : uint8_t { START = 1, STOP = 2, RATE = 3, TARE = 4, ASK_HELLO = 5 };
enum Kind : uint8_t { FORCE = 0, FORCE_X, FORCE_Y, FORCE_Z, DEPTH, X, Y, Z, TEMPERATURE, OTHER };
enum Format : uint8_t { INT16 = 0, INT32 = 1, FLOAT32 = 2 };
enum Unit : uint8_t { RAW = 0, NEWTON = 1, MILLIMETRE = 2, MICROMETRE = 3, CELSIUS = 4 };

const size_t kHeader = 8;
const size_t kLongestBody = 244;

inline uint16_t crc16(const uint8_t* bytes, size_t count) {
  uint16_t crc = 0xFFFF;
  while (count--) {
    crc ^= (uint16_t)(*bytes++) << 8;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x8000) ? (uint16_t)((crc << 1) ^ 0x1021) : (uint16_t)(crc << 1);
  }
  return crc;
}

// Encodes outgoing frames. `wire` must hold 257 bytes. Returns the number of bytes to send.
class Encoder {
 public:
  size_t frame(Type type, uint32_t time_us, const void* body, size_t length, uint8_t* wire) {
    uint8_t bytes[kHeader + kLongestBody + 2];
    bytes[0] = (uint8_t)(1 << 4 | type);
    bytes[1] = 0;
    memcpy(bytes + 2, &sequence_, 2);
    memcpy(bytes + 4, &time_us, 4);
    if (length > 0) memcpy(bytes + kHeader, body, length);
    ++sequence_;
    const size_t end = kHeader + length;
    const uint16_t crc = crc16(bytes, end);
    memcpy(bytes + end, &crc, 2);
    size_t out = 1, code = 0;
    wire[0] = 1;
    for (size_t i = 0; i < end + 2; ++i) {
      if (bytes[i] != 0) {
        wire[out++] = bytes[i];
        if (++wire[code] != 0xFF) continue;
      }
      code = out;
      wire[out++] = 1;
    }
    wire[out++] = 0;
    return out;
  }

 private:
  uint16_t sequence_ = 0;
};

// Decodes incoming frames. take() returns true at the end of a complete, correct frame.
class Decoder {
 public:
  uint8_t type = 0;
  const uint8_t* body = 0;
  size_t length = 0;

  bool take(uint8_t byte) {
    if (byte != 0) {
      if (count_ < sizeof wire_) wire_[count_] = byte;
      if (count_ <= sizeof wire_) ++count_;
      return false;
    }
    const size_t count = count_;
    count_ = 0;
    if (count == 0 || count > sizeof wire_) return false;
    size_t in = 0, out = 0;
    while (in < count) {
      const size_t code = wire_[in++];
      if (in + code - 1 > count) return false;
      for (size_t i = 1; i < code; ++i) wire_[out++] = wire_[in++];
      if (code != 0xFF && in < count) wire_[out++] = 0;
    }
    if (out < kHeader + 2) return false;
    uint16_t crc;
    memcpy(&crc, wire_ + out - 2, 2);
    if (crc16(wire_, out - 2) != crc) return false;
    type = wire_[0] & 0xF;
    body = wire_ + kHeader;
    length = out - 2 - kHeader;
    return true;
  }

 private:
  uint8_t wire_[80];  // commands are short; longer frames are ignored
  size_t count_ = 0;
};

}  // namespace hbf1
