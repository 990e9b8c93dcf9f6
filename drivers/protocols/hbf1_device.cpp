#include <algorithm>
#include <bit>
#include <cmath>
#include <string_view>

#include "core/units.hpp"
#include "drivers/protocols/hbf1.hpp"
#include "drivers/protocols/hbf1_channels.hpp"
#include "drivers/protocols/hbf1_frame.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

void append_f32(double value, Bytes& bytes) {
  append_u32(std::bit_cast<std::uint32_t>(static_cast<float>(value)), bytes);
}

class Hbf1Device final : public SimulatedDevice {
 public:
  explicit Hbf1Device(std::uint32_t channels) : channels_(channels) {}

  void boot(nanoseconds now, Bytes& out) override {
    decoder_.reset(false);
    sequence_ = 0;
    started_ = false;
    out.push_back(0);
    hello(now, out);
  }

  void take(std::span<const std::uint8_t> bytes, nanoseconds now, Bytes& out) override {
    for (const std::uint8_t byte : bytes) {
      const auto frame = decoder_.take(byte);
      if (!frame) continue;
      if (frame->header.type == Hbf1Type::kSyncRequest && frame->body.size() == 4) {
        Bytes body(frame->body.begin(), frame->body.end());
        append_u32(clock_us(now), body);
        send(Hbf1Type::kSyncResponse, now, body, out);
      }
      if (frame->header.type != Hbf1Type::kCommand || frame->body.empty()) continue;
      const auto command = static_cast<Hbf1Command>(frame->body[0]);
      if (command == Hbf1Command::kHello) hello(now, out);
      if (command == Hbf1Command::kRate && frame->body.size() == 3) {
        requested_rate_Hz_ = read_u16(frame->body.subspan<1, 2>());
      }
      if (command == Hbf1Command::kStart) started_ = true;
      if (command == Hbf1Command::kStop) started_ = false;
      const Bytes body = {frame->body[0], 0};
      send(Hbf1Type::kAcknowledge, now, body, out);
    }
  }

  void measure(const ProbeSample& sample, nanoseconds now, Bytes& out) override {
    if (!started_) return;
    Bytes body;
    append_u16(0, body);
    if (sample.has(ProbeSample::kForce)) append_f32(units::N_from_mN(sample.force_mN), body);
    if (sample.has(ProbeSample::kDepth)) append_f32(sample.depth_mm, body);
    if (sample.has(ProbeSample::kX)) append_f32(sample.x_mm, body);
    if (sample.has(ProbeSample::kY)) append_f32(sample.y_mm, body);
    send(Hbf1Type::kSample, now, body, out);
  }

  [[nodiscard]] bool started() const noexcept override { return started_; }
  [[nodiscard]] std::optional<nanoseconds> period() const noexcept override {
    return period_of(static_cast<double>(requested_rate_Hz_));
  }
  void set_rate(double rate_Hz) override { rate_Hz_ = std::lround(rate_Hz); }

 private:
  static std::uint32_t clock_us(nanoseconds now) {
    return static_cast<std::uint32_t>(std::chrono::duration_cast<microseconds>(now).count());
  }

  void send(Hbf1Type type, nanoseconds now, std::span<const std::uint8_t> body, Bytes& out) {
    append_hbf1_frame({.type = type, .sequence = sequence_++, .time_us = clock_us(now)}, body, out);
  }

  void hello(nanoseconds now, Bytes& out) {
    Bytes list;
    std::uint8_t count = 0;
    const auto add = [&](std::uint32_t bit, DeviceChannel channel, std::uint8_t unit) {
      if ((channels_ & bit) == 0U) return;
      const auto kind =
          std::find(kHbf1Kinds.begin(), kHbf1Kinds.end(), channel) - kHbf1Kinds.begin();
      list.push_back(static_cast<std::uint8_t>(kind));
      list.push_back(static_cast<std::uint8_t>(Hbf1Format::kFloat));
      list.push_back(unit);
      append_f32(1.0, list);
      append_f32(0.0, list);
      ++count;
    };
    add(ProbeSample::kForce, DeviceChannel::kForce, kHbf1Newton);
    add(ProbeSample::kDepth, DeviceChannel::kDepth, kHbf1Millimetre);
    add(ProbeSample::kX, DeviceChannel::kX, kHbf1Millimetre);
    add(ProbeSample::kY, DeviceChannel::kY, kHbf1Millimetre);
    Bytes body = {1, count};
    append_u16(static_cast<std::uint16_t>(std::clamp(rate_Hz_, 0L, 65535L)), body);
    for (const std::string_view name : {"SIM1", "simulated"}) {
      body.push_back(static_cast<std::uint8_t>(name.size()));
      body.insert(body.end(), name.begin(), name.end());
    }
    body.insert(body.end(), list.begin(), list.end());
    send(Hbf1Type::kHello, now, body, out);
  }

  std::uint32_t channels_;
  Hbf1Decoder decoder_;
  std::uint16_t sequence_ = 0;
  bool started_ = false;
  long rate_Hz_ = 1000;
  std::uint16_t requested_rate_Hz_ = 0;  ///< requested by the host; 0: the trace's
};

}  // namespace

std::unique_ptr<SimulatedDevice> make_hbf1_device(std::uint32_t channels) {
  return std::make_unique<Hbf1Device>(channels);
}

}  // namespace merkel
