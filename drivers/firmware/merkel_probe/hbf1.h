// HBF1 frames for a microcontroller: COBS(header | body | CRC) and a 0. No heap, no library.
//
// drivers/protocols/README.md describes the frames; a test encodes with this file and decodes with the host's. Needs a little-endian core (all Arduino and Teensy boards).
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>

namespace hbf1 {

enum Type : uint8_t { HELLO = 0, SAMPLE = 1, EVENT = 2, TEXT = 3, SYNC_RSP = 4, ACK = 5, CMD = 8, SYNC_REQ = 9 };
enum Command : uint8_t { START = 1, STOP = 2, RATE = 3, TARE = 4, ASK_HELLO = 5 };
enum Kind : uint8_t { FORCE = 0, FORCE_X, FORCE_Y, FORCE_Z, DEPTH, X, Y, Z, TEMPERATURE, OTHER, PRESSURE };
enum Format : uint8_t { INT16 = 0, INT32 = 1, FLOAT32 = 2 };
enum Unit : uint8_t { RAW = 0, NEWTON = 1, MILLIMETRE = 2, MICROMETRE = 3, CELSIUS = 4, KILOPASCAL = 5 };

const uint16_t kEdge = 1;  // code of an EVENT: the level of a sync line changes

const size_t kHeader = 8;
const size_t kMaxBody = 244;
const size_t kMaxName = 64;  // longer names are truncated

// A channel of the samples, or several like ones: {PRESSURE, INT16, KILOPASCAL, 0.01f, 0, 16, "taxel"} are taxel1 to taxel16.
struct Channel {
  Kind kind;
  Format format;
  Unit unit;
  float scale, offset;  // value = scale * number + offset
  uint8_t repeats;
  const char* name;  // letters, digits, - and _; "" for the only one of its kind
};

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
    uint8_t bytes[kHeader + kMaxBody + 2];
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

// Writes the HELLO of a device: in version 1, or in version 2 if channels have names or are many. A list of
// channels that does not fit in one frame goes into several: send each until next() returns 0.
class Hello {
 public:
  Hello(const char* serial_number, const char* firmware, uint16_t rate_hz, const Channel* channels, size_t entries)
      : serial_number_(serial_number),
        firmware_(firmware),
        rate_hz_(rate_hz),
        channels_(channels),
        entries_(entries),
        named_(entries > 8) {
    for (size_t i = 0; i < entries; ++i) {
      count_ = (uint8_t)(count_ + channels[i].repeats);
      named_ = named_ || channels[i].repeats > 1 || channels[i].name[0] != 0;
    }
  }

  // Writes the body of the next frame, at most kMaxBody bytes. Returns its length.
  size_t next(uint8_t* body) {
    if (entry_ == entries_) return 0;
    size_t n = 0;
    body[n++] = named_ ? 2 : 1;
    body[n++] = count_;
    memcpy(body + n, &rate_hz_, 2);
    n += 2;
    n += text(serial_number_, body + n);
    n += text(firmware_, body + n);
    if (named_) body[n++] = first_;
    const size_t longest = named_ ? 13 + kMaxName : 11;
    while (entry_ < entries_ && n + longest <= kMaxBody) {
      const Channel& channel = channels_[entry_++];
      body[n++] = channel.kind;
      body[n++] = channel.format;
      body[n++] = channel.unit;
      memcpy(body + n, &channel.scale, 4);
      memcpy(body + n + 4, &channel.offset, 4);
      n += 8;
      first_ = (uint8_t)(first_ + channel.repeats);
      if (!named_) continue;
      body[n++] = channel.repeats;
      n += text(channel.name, body + n);
    }
    return n;
  }

 private:
  static size_t text(const char* text, uint8_t* out) {
    const size_t whole = strlen(text);
    const size_t length = whole < kMaxName ? whole : kMaxName;
    out[0] = (uint8_t)length;
    memcpy(out + 1, text, length);
    return 1 + length;
  }

  const char* serial_number_;
  const char* firmware_;
  uint16_t rate_hz_;
  const Channel* channels_;
  size_t entries_, entry_ = 0;
  uint8_t count_ = 0, first_ = 0;
  bool named_;
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
