// Reference firmware of an HBF1 probe for Arduino and Teensy boards: one load cell, one position sensor; or,
// with #define HAND, six load cells of a hand. Change channels, read_channel() and serial_number; keep the rest.
//
// 1 kHz needs a board with native USB (Teensy, RP2040, SAMD, ESP32-S3), where the baud rate has no
// effect, or a UART with 500000 Bd. (460800 Bd is 8.5 % wrong on an AVR of 16 MHz, which divides its clock by
// multiples of 8; 500000 is exact.)

#include "hbf1.h"
#include "pulses.h"

static const char* serial_number = "PROBE-001";
static const char* firmware = "merkel_probe 2";

// The numbers of a sample, in order. A probe reads them by their names: thumb_N, index_N, …
#ifndef HAND
static const hbf1::Channel channels[] = {
    {hbf1::FORCE, hbf1::FLOAT32, hbf1::NEWTON, 1, 0, 1, ""},
    {hbf1::DEPTH, hbf1::FLOAT32, hbf1::MILLIMETRE, 1, 0, 1, ""},
};
static float read_channel(uint8_t i) {
  return i == 0 ? analogRead(A0) * (10.0f / 1023.0f) : analogRead(A1) * (5.0f / 1023.0f);
}
#else
static const hbf1::Channel channels[] = {
    {hbf1::FORCE, hbf1::FLOAT32, hbf1::NEWTON, 1, 0, 1, "thumb"},
    {hbf1::FORCE, hbf1::FLOAT32, hbf1::NEWTON, 1, 0, 1, "index"},
    {hbf1::FORCE, hbf1::FLOAT32, hbf1::NEWTON, 1, 0, 1, "middle"},
    {hbf1::FORCE, hbf1::FLOAT32, hbf1::NEWTON, 1, 0, 1, "ring"},
    {hbf1::FORCE, hbf1::FLOAT32, hbf1::NEWTON, 1, 0, 1, "little"},
    {hbf1::FORCE, hbf1::FLOAT32, hbf1::NEWTON, 1, 0, 1, "palm"},
};
static float read_channel(uint8_t i) { return analogRead(A0 + i) * (10.0f / 1023.0f); }
#endif
const uint8_t kChannels = sizeof channels / sizeof channels[0];

static hbf1::Encoder encoder;
static hbf1::Decoder decoder;
static uint8_t wire[260];
static bool streaming = false;
static uint16_t rate_hz = 1000;
static uint32_t next_us = 0;
static uint32_t last_hello_ms = 0;
static float zeros[kChannels];  // of the forces, by a tare

// Sync lines. The board makes irregular pulses on SYNC_OUT while it streams: connect it, and ground, to a
// digital input of every other recorder. Or connect the pulses of another recorder to SYNC_IN. The
// board reports each edge with its own time: line 1 is SYNC_OUT, line 2 is SYNC_IN.
const uint8_t SYNC_OUT = 4;
const uint8_t SYNC_IN = 2;  // with an interrupt
static hbf1::Pulses pulses(1);
static uint32_t pulse_us = 0;  // the next edge
static volatile uint32_t heard_us[8];  // the last edges of SYNC_IN
static volatile bool heard_high[8];
static volatile uint8_t heard = 0;
static uint8_t reported = 0;

static void hear_edge() {
  heard_us[heard % 8] = micros();
  heard_high[heard % 8] = digitalRead(SYNC_IN);
  heard = heard + 1;
}

static void send(hbf1::Type type, uint32_t time_us, const void* body, size_t length) {
  Serial.write(wire, encoder.frame(type, time_us, body, length, wire));
}

static void report_edge(uint8_t line, bool high, uint32_t time_us) {
  struct __attribute__((packed)) {
    uint16_t code, line, level;
  } edge = {hbf1::kEdge, line, high};
  send(hbf1::EVENT, time_us, &edge, sizeof edge);
}

static void sync() {
  if ((int32_t)(micros() - pulse_us) >= 0) {
    const uint32_t length_us = pulses.next_us();
    digitalWrite(SYNC_OUT, pulses.high());
    const uint32_t now = micros();
    pulse_us = now + length_us;
    report_edge(1, pulses.high(), now);
  }
  if ((uint8_t)(heard - reported) > 8) reported = heard - 8;
  for (; reported != heard; ++reported) report_edge(2, heard_high[reported % 8], heard_us[reported % 8]);
}

static void hello() {
  uint8_t body[hbf1::kMaxBody];
  hbf1::Hello list(serial_number, firmware, rate_hz, channels, kChannels);
  while (const size_t length = list.next(body)) send(hbf1::HELLO, micros(), body, length);
  last_hello_ms = millis();
}

static void obey(uint32_t received_us) {
  if (decoder.type == hbf1::SYNC_REQ && decoder.length == 4) {
    uint8_t body[8];
    memcpy(body, decoder.body, 4);
    memcpy(body + 4, &received_us, 4);
    send(hbf1::SYNC_RSP, micros(), body, sizeof body);
    return;
  }
  if (decoder.type != hbf1::CMD || decoder.length == 0) return;
  uint8_t answer[2] = {decoder.body[0], 0};
  switch (decoder.body[0]) {
    case hbf1::START:
      streaming = true;
      next_us = pulse_us = micros();
      pulses = hbf1::Pulses(micros() * 2654435761UL);  // other pulses in every run
      reported = heard;
      break;
    case hbf1::STOP:
      streaming = false;
      digitalWrite(SYNC_OUT, LOW);
      break;
    case hbf1::RATE:
      if (decoder.length == 3) memcpy(&rate_hz, decoder.body + 1, 2);
      if (rate_hz == 0) rate_hz = 1;
      break;
    case hbf1::TARE:
      for (uint8_t i = 0; i < kChannels; ++i) zeros[i] = channels[i].kind <= hbf1::FORCE_Z ? read_channel(i) : 0;
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
  pinMode(SYNC_OUT, OUTPUT);
  pinMode(SYNC_IN, INPUT_PULLUP);
  attachInterrupt(digitalPinToInterrupt(SYNC_IN), hear_edge, CHANGE);
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
  sync();
  const uint32_t now = micros();
  if ((int32_t)(now - next_us) < 0) return;
  const uint32_t period_us = 1000000UL / rate_hz;
  next_us += period_us;
  // A board too slow for the rate sends as fast as it can; missed samples are skipped.
  if (now - next_us >= period_us && (int32_t)(now - next_us) > 0) next_us = now;
  struct __attribute__((packed)) {
    uint16_t status;
    float values[kChannels];
  } sample;
  sample.status = 0;
  for (uint8_t i = 0; i < kChannels; ++i) sample.values[i] = read_channel(i) - zeros[i];
  send(hbf1::SAMPLE, now, &sample, sizeof sample);
}
