// Reference firmware of an HBF1 probe for Arduino and Teensy boards: one load cell, one position sensor.
// Change read_force_N(), read_depth_mm() and serial_number; keep the rest.
//
// 1 kHz needs a board with native USB (Teensy, RP2040, SAMD, ESP32-S3), where the baud rate has no
// effect, or a UART with 500000 Bd. (460800 Bd is 8.5 % wrong on an AVR of 16 MHz, which divides its clock by
// multiples of 8; 500000 is exact.)

#include "hbf1.h"

static const char* serial_number = "PROBE-001";
static const char* firmware = "merkel_probe 1";
const size_t kLongestName = 64;  // longer names are truncated

static hbf1::Encoder encoder;
static hbf1::Decoder decoder;
static uint8_t wire[260];
static bool streaming = false;
static uint16_t rate_hz = 1000;
static uint32_t next_us = 0;
static uint32_t last_hello_ms = 0;
static float zero_N = 0;

static float read_force_N() { return analogRead(A0) * (10.0f / 1023.0f); }
static float read_depth_mm() { return analogRead(A1) * (5.0f / 1023.0f); }

static void send(hbf1::Type type, uint32_t time_us, const void* body, size_t length) {
  Serial.write(wire, encoder.frame(type, time_us, body, length, wire));
}

static size_t add_channel(uint8_t* out, hbf1::Kind kind, hbf1::Unit unit) {
  const float scale = 1, offset = 0;
  out[0] = kind;
  out[1] = hbf1::FLOAT32;
  out[2] = unit;
  memcpy(out + 3, &scale, 4);
  memcpy(out + 7, &offset, 4);
  return 11;
}

static void hello() {
  uint8_t body[hbf1::kLongestBody];
  size_t n = 0;
  body[n++] = 1;  // protocol
  body[n++] = 2;  // channels
  memcpy(body + n, &rate_hz, 2);
  n += 2;
  const char* const names[] = {serial_number, firmware};
  for (const char* name : names) {
    const size_t whole = strlen(name);
    const size_t length = whole < kLongestName ? whole : kLongestName;
    body[n++] = (uint8_t)length;
    memcpy(body + n, name, length);
    n += length;
  }
  n += add_channel(body + n, hbf1::FORCE, hbf1::NEWTON);
  n += add_channel(body + n, hbf1::DEPTH, hbf1::MILLIMETRE);
  send(hbf1::HELLO, micros(), body, n);
  last_hello_ms = millis();
}

static void obey(uint32_t heard_us) {
  if (decoder.type == hbf1::SYNC_REQ && decoder.length == 4) {
    uint8_t body[8];
    memcpy(body, decoder.body, 4);
    memcpy(body + 4, &heard_us, 4);
    send(hbf1::SYNC_RSP, micros(), body, sizeof body);
    return;
  }
  if (decoder.type != hbf1::CMD || decoder.length == 0) return;
  uint8_t answer[2] = {decoder.body[0], 0};
  switch (decoder.body[0]) {
    case hbf1::START:
      streaming = true;
      next_us = micros();
      break;
    case hbf1::STOP:
      streaming = false;
      break;
    case hbf1::RATE:
      if (decoder.length == 3) memcpy(&rate_hz, decoder.body + 1, 2);
      if (rate_hz == 0) rate_hz = 1;
      break;
    case hbf1::TARE:
      zero_N = read_force_N();
      break;
    case hbf1::ASK_HELLO:
      hello();
      break;
    default:
      answer[1] = 1;  // unknown command
  }
  send(hbf1::ACK, micros(), answer, sizeof answer);
}

void setup() {
  Serial.begin(500000);
  Serial.write((uint8_t)0);  // ends a partial frame on the host's side
  hello();
}

void loop() {
  while (Serial.available() > 0) {
    if (decoder.take((uint8_t)Serial.read())) obey(micros());
  }
  if (!streaming) {
    if (millis() - last_hello_ms >= 1000) hello();
    return;
  }
  const uint32_t now = micros();
  if ((int32_t)(now - next_us) < 0) return;
  const uint32_t period_us = 1000000UL / rate_hz;
  next_us += period_us;
  // A board too slow for the rate sends as fast as it can; missed samples are skipped.
  if (now - next_us >= period_us && (int32_t)(now - next_us) > 0) next_us = now;
  struct __attribute__((packed)) {
    uint16_t status;
    float force_N;
    float depth_mm;
  } sample = {0, read_force_N() - zero_N, read_depth_mm()};
  send(hbf1::SAMPLE, now, &sample, sizeof sample);
}
