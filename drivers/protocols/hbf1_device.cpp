#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/units.hpp"
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wconversion"
#include "drivers/firmware/merkel_probe/hbf1.h"
#pragma GCC diagnostic pop
#include "drivers/firmware/merkel_probe/pulses.h"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/hbf1_channels.hpp"
#include "drivers/protocols/hbf1_frame.hpp"
#include "drivers/protocols/protocol_makers.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

void append_f32(double value, Bytes& bytes) {
  append_u32(std::bit_cast<std::uint32_t>(static_cast<float>(value)), bytes);
}

/// A name that a HELLO may give.
std::string sent_name(std::string_view name) {
  std::string valid(name.substr(0, hbf1::kMaxName));
  for (char& c : valid) c = is_in_hbf1_name(c) ? c : '_';
  return valid;
}

class Hbf1Device final : public SimulatedDevice {
 public:
  explicit Hbf1Device(std::uint32_t channels) {
    const auto add = [&](std::uint32_t bit, hbf1::Kind kind, hbf1::Unit unit) {
      if ((channels & bit) != 0U) add_channel("", kind, unit);
    };
    add(ProbeSample::kForce, hbf1::FORCE, hbf1::NEWTON);
    add(ProbeSample::kDepth, hbf1::DEPTH, hbf1::MILLIMETRE);
    add(ProbeSample::kX, hbf1::X, hbf1::MILLIMETRE);
    add(ProbeSample::kY, hbf1::Y, hbf1::MILLIMETRE);
  }

  /// Columns that measure something become channels with their names.
  [[nodiscard]] bool set_columns(const std::vector<std::string>& names) override {
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto column = csv_column_named(names[i]);
      if (!column || column->kind != CsvColumn::Kind::kValue) continue;
      const bool force = column->quantity == Quantity::kForce;
      const bool pressure = column->quantity == Quantity::kPressure;
      add_channel(names[i], force ? hbf1::FORCE : (pressure ? hbf1::PRESSURE : hbf1::DEPTH),
                  force ? hbf1::NEWTON : (pressure ? hbf1::KILOPASCAL : hbf1::MILLIMETRE),
                  static_cast<float>(column->factor));
      further_.push_back(i);
    }
    return names.empty() || !further_.empty();
  }

  [[nodiscard]] bool set_taxels(const std::vector<std::string>& names,
                                double largest_kPa) override {
    if (names.empty()) return true;
    constexpr double kRange = 32'000.0;  // of 16 bits
    const auto scale = static_cast<float>(std::max(largest_kPa, 1.0) / kRange);
    const std::size_t others = 4 * channels_.size();
    if (others + 2 * names.size() > kHbf1LongestBody - kHbf1StatusBytes) return false;
    if (csv_names_of("taxel_kPa*" + std::to_string(names.size())) == names) {
      add_channel("taxel_kPa", hbf1::PRESSURE, hbf1::KILOPASCAL, scale, hbf1::INT16,
                  static_cast<std::uint8_t>(names.size()));
    } else {
      for (const std::string& name : names) {
        add_channel(name, hbf1::PRESSURE, hbf1::KILOPASCAL, scale, hbf1::INT16);
      }
    }
    taxel_scale_ = static_cast<double>(scale);
    taxels_ = names.size();
    return true;
  }

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
      if (command == Hbf1Command::kStart) {
        started_ = true;
        next_edge_ = now;
      }
      if (command == Hbf1Command::kStop) started_ = false;
      const Bytes body = {frame->body[0], 0};
      send(Hbf1Type::kAcknowledge, now, body, out);
    }
  }

  void measure(const ProbeSample& sample, std::span<const double> others, nanoseconds now,
               Bytes& out) override {
    if (!started_) return;
    while (pulses_ && next_edge_ <= now) {
      const nanoseconds edge = next_edge_;
      next_edge_ += microseconds{pulses_->next_us()};
      Bytes event;
      append_u16(kHbf1Edge, event);
      append_u16(1, event);
      append_u16(pulses_->high() ? 1 : 0, event);
      send(Hbf1Type::kEvent, edge, event, out);
    }
    Bytes body;
    append_u16(0, body);
    if (sample.has(ProbeSample::kForce)) append_f32(units::N_from_mN(sample.force_mN), body);
    if (sample.has(ProbeSample::kDepth)) append_f32(sample.depth_mm, body);
    if (sample.has(ProbeSample::kX)) append_f32(sample.x_mm, body);
    if (sample.has(ProbeSample::kY)) append_f32(sample.y_mm, body);
    for (const std::size_t column : further_) append_f32(others[column], body);
    for (const double kPa : others.last(taxels_)) {
      append_u16(static_cast<std::uint16_t>(std::lround(kPa / taxel_scale_)), body);
    }
    send(Hbf1Type::kSample, now, body, out);
  }

  [[nodiscard]] bool started() const noexcept override { return started_; }
  [[nodiscard]] std::optional<nanoseconds> period() const noexcept override {
    return period_of(static_cast<double>(requested_rate_Hz_));
  }
  [[nodiscard]] bool set_pulses(std::uint32_t seed) override {
    pulses_.emplace(seed);
    return true;
  }
  void set_rate(double rate_Hz) override { rate_Hz_ = std::lround(rate_Hz); }

 private:
  static std::uint32_t clock_us(nanoseconds now) {
    return static_cast<std::uint32_t>(std::chrono::duration_cast<microseconds>(now).count());
  }

  void send(Hbf1Type type, nanoseconds now, std::span<const std::uint8_t> body, Bytes& out) {
    append_hbf1_frame({.type = type, .sequence = sequence_++, .time_us = clock_us(now)}, body, out);
  }

  /// \param name  with its unit; empty: the only one of its kind
  void add_channel(std::string_view name, hbf1::Kind kind, hbf1::Unit unit, float scale = 1.0F,
                   hbf1::Format format = hbf1::FLOAT32, std::uint8_t repeats = 1) {
    names_.push_back(sent_name(name.substr(0, name.rfind('_'))));
    channels_.push_back({kind, format, unit, scale, 0.0F, repeats, names_.back().c_str()});
  }

  /// Sends the list of channels, in as many frames as it takes.
  void hello(nanoseconds now, Bytes& out) {
    const auto rate_Hz = static_cast<std::uint16_t>(std::clamp(rate_Hz_, 0L, 65535L));
    hbf1::Hello list("SIM1", "simulated", rate_Hz, channels_.data(), channels_.size());
    std::array<std::uint8_t, hbf1::kMaxBody> body{};
    while (const std::size_t length = list.next(body.data())) {
      send(Hbf1Type::kHello, now, std::span(body).first(length), out);
    }
  }

  std::deque<std::string> names_;
  std::vector<hbf1::Channel> channels_;
  std::vector<std::size_t> further_;  ///< of the trace's columns, those that are sent
  std::size_t taxels_ = 0;
  double taxel_scale_ = 1.0;  ///< kPa in a count
  Hbf1Decoder decoder_;
  std::uint16_t sequence_ = 0;
  bool started_ = false;
  long rate_Hz_ = 1000;
  std::optional<hbf1::Pulses> pulses_;  ///< on its sync line
  nanoseconds next_edge_{0};
  std::uint16_t requested_rate_Hz_ = 0;  ///< requested by the host; 0: the trace's
};

}  // namespace

std::unique_ptr<SimulatedDevice> make_hbf1_device(std::uint32_t channels) {
  return std::make_unique<Hbf1Device>(channels);
}

}  // namespace merkel
