#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "core/units.hpp"
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
  constexpr std::size_t kMaxName = 64;
  std::string valid(name.substr(0, kMaxName));
  for (char& c : valid) c = is_in_hbf1_name(c) ? c : '_';
  return valid;
}

class Hbf1Device final : public SimulatedDevice {
 public:
  explicit Hbf1Device(std::uint32_t channels) {
    const auto add = [&](std::uint32_t bit, DeviceChannel channel, std::uint8_t unit) {
      if ((channels & bit) == 0U) return;
      const auto kind =
          std::find(kHbf1Kinds.begin(), kHbf1Kinds.end(), channel) - kHbf1Kinds.begin();
      entries_.push_back({.kind = static_cast<std::uint8_t>(kind), .unit = unit});
    };
    add(ProbeSample::kForce, DeviceChannel::kForce, kHbf1Newton);
    add(ProbeSample::kDepth, DeviceChannel::kDepth, kHbf1Millimetre);
    add(ProbeSample::kX, DeviceChannel::kX, kHbf1Millimetre);
    add(ProbeSample::kY, DeviceChannel::kY, kHbf1Millimetre);
  }

  /// Columns that measure something become channels with their names.
  [[nodiscard]] bool set_columns(const std::vector<std::string>& names) override {
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto column = csv_column_named(names[i]);
      if (!column || column->kind != CsvColumn::Kind::kValue) continue;
      Entry entry{.name = sent_name(names[i].substr(0, names[i].rfind('_')))};
      entry.scale = column->factor;
      const bool force = column->quantity == Quantity::kForce;
      const bool pressure = column->quantity == Quantity::kPressure;
      entry.kind = force ? std::uint8_t{0} : (pressure ? kHbf1Pressure : kHbf1FirstLength);
      entry.unit = force ? kHbf1Newton : (pressure ? kHbf1Kilopascal : kHbf1Millimetre);
      entries_.push_back(std::move(entry));
      further_.push_back(i);
    }
    return names.empty() || !further_.empty();
  }

  [[nodiscard]] bool set_taxels(const std::vector<std::string>& names,
                                double largest_kPa) override {
    if (names.empty()) return true;
    constexpr double kRange = 32'000.0;  // of 16 bits
    const double scale = std::max(largest_kPa, 1.0) / kRange;
    Entry entry{.kind = kHbf1Pressure,
                .format = Hbf1Format::kInt16,
                .unit = kHbf1Kilopascal,
                .scale = static_cast<double>(static_cast<float>(scale))};
    const std::size_t others = 4 * entries_.size();
    if (others + 2 * names.size() > kHbf1LongestBody - kHbf1StatusBytes) return false;
    if (csv_names_of("taxel_kPa*" + std::to_string(names.size())) == names) {
      entry.name = "taxel";
      entry.repeats = static_cast<std::uint8_t>(names.size());
      entries_.push_back(entry);
    } else {
      for (const std::string& name : names) {
        entry.name = sent_name(name.substr(0, name.rfind('_')));
        entries_.push_back(entry);
      }
    }
    taxel_scale_ = entry.scale;
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

  struct Entry {
    std::uint8_t kind = 0;
    Hbf1Format format = Hbf1Format::kFloat;
    std::uint8_t unit = 0;
    double scale = 1.0;
    std::uint8_t repeats = 1;
    std::string name = {};  ///< empty: the only one of its kind
  };

  /// Sends the list of channels, in as many frames as it takes.
  void hello(nanoseconds now, Bytes& out) {
    const bool named = std::any_of(entries_.begin(), entries_.end(),
                                   [](const Entry& entry) { return !entry.name.empty(); });
    std::size_t count = 0;
    for (const Entry& entry : entries_) count += entry.repeats;
    Bytes head = {std::uint8_t{1}, static_cast<std::uint8_t>(count)};
    append_u16(static_cast<std::uint16_t>(std::clamp(rate_Hz_, 0L, 65535L)), head);
    for (const std::string_view name : {"SIM1", "simulated"}) {
      head.push_back(static_cast<std::uint8_t>(name.size()));
      head.insert(head.end(), name.begin(), name.end());
    }
    std::uint8_t first = 0;
    if (named) {
      head[0] = 2;
      head.push_back(first);
    }
    Bytes body = head;
    for (const Entry& entry : entries_) {
      Bytes bytes = {entry.kind, static_cast<std::uint8_t>(entry.format), entry.unit};
      append_f32(entry.scale, bytes);
      append_f32(0.0, bytes);
      if (named) {
        bytes.push_back(entry.repeats);
        bytes.push_back(static_cast<std::uint8_t>(entry.name.size()));
        bytes.insert(bytes.end(), entry.name.begin(), entry.name.end());
      }
      if (body.size() + bytes.size() > kHbf1LongestBody) {
        send(Hbf1Type::kHello, now, body, out);
        head.back() = first;
        body = head;
      }
      body.insert(body.end(), bytes.begin(), bytes.end());
      first = static_cast<std::uint8_t>(first + entry.repeats);
    }
    send(Hbf1Type::kHello, now, body, out);
  }

  std::vector<Entry> entries_;
  std::vector<std::size_t> further_;  ///< of the trace's columns, those that are sent
  std::size_t taxels_ = 0;
  double taxel_scale_ = 1.0;  ///< kPa in a count
  std::span<const float> pressures_kPa_;
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
