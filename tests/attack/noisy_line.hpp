#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "core/math/random.hpp"
#include "core/units.hpp"
#include "drivers/probes/device_probe.hpp"
#include "drivers/protocols/protocol_table.hpp"

namespace merkel {

/// A clock that only its readers move.
class VirtualHost final : public HostClock {
 public:
  [[nodiscard]] std::chrono::nanoseconds now() override { return time; }
  void sleep_for(std::chrono::nanoseconds duration) override { time += duration; }
  std::chrono::nanoseconds time{std::chrono::seconds{1000}};
};

/// The bytes that a serial port receives at `received` Bd if they are sent at `sent` Bd, without
/// pauses between them.
inline Bytes at_another_baud(const Bytes& bytes, double sent, double received) {
  std::vector<bool> bits;  // idle, start, eight data bits, stop
  bits.push_back(true);
  for (const std::uint8_t byte : bytes) {
    bits.push_back(false);
    for (unsigned bit = 0; bit < 8; ++bit) bits.push_back((byte >> bit & 1U) != 0);
    bits.push_back(true);
  }
  const double step = sent / received;  // sent bits in a received bit
  const auto level = [&](double place) {
    const auto at = static_cast<std::size_t>(std::max(place, 0.0));
    return at >= bits.size() || bits[at];
  };
  Bytes heard;
  for (double place = 0.0; place < static_cast<double>(bits.size());) {
    if (level(place)) {
      place += 0.1 * step;
      continue;
    }
    unsigned byte = 0;
    for (unsigned bit = 0; bit < 8; ++bit) {
      if (level(place + step * (1.5 + bit))) byte |= 1U << bit;
    }
    heard.push_back(static_cast<std::uint8_t>(byte));
    place += 9.5 * step;
  }
  return heard;
}

/// A simulated device on a line that may change all bytes. A sample every 4 ms: a press of 1 N and
/// 1 mm.
class NoisyLine final : public Transport {
 public:
  using Change = std::function<Bytes(Bytes sent)>;

  NoisyLine(VirtualHost& host, std::string_view protocol)
      : host_(host), device_((*find_protocol(protocol))->simulate(kChannels)) {
    info_.name = "virtual";
    device_->boot(host_.time, wire_);
  }

  /// What happens to each millisecond's bytes; empty: nothing.
  Change change;

  [[nodiscard]] const TransportInfo& info() const noexcept override { return info_; }
  [[nodiscard]] Expected<std::size_t, Disconnected> read(
      std::span<std::uint8_t> bytes, std::chrono::nanoseconds patience) override {
    const auto until = host_.time + patience;
    while (arrived_.empty() && host_.time < until) {
      host_.time +=
          std::min<std::chrono::nanoseconds>(std::chrono::milliseconds{1}, until - host_.time);
      measure();
      const Bytes sent = std::exchange(wire_, {});
      const Bytes heard = change ? change(sent) : sent;
      arrived_.insert(arrived_.end(), heard.begin(), heard.end());
    }
    const std::size_t count = std::min(bytes.size(), arrived_.size());
    std::copy_n(arrived_.begin(), count, bytes.begin());
    arrived_.erase(arrived_.begin(), arrived_.begin() + static_cast<std::ptrdiff_t>(count));
    return count;
  }
  [[nodiscard]] Expected<void, Disconnected> write(std::span<const std::uint8_t> bytes) override {
    device_->take(bytes, host_.time, wire_);
    return {};
  }
  [[nodiscard]] Expected<void, SetupError> reopen() override { return {}; }

 private:
  static constexpr std::uint32_t kChannels =
      ProbeSample::kDepth | ProbeSample::kForce | ProbeSample::kX | ProbeSample::kY;

  void measure() {
    if (!device_->started() || host_.time < next_) return;
    next_ = host_.time + std::chrono::milliseconds{4};
    device_->measure(
        {.time = host_.time, .depth_mm = 1.0, .force_mN = 1000.0, .channels = kChannels}, {},
        host_.time, wire_);
  }

  VirtualHost& host_;
  std::unique_ptr<SimulatedDevice> device_;
  TransportInfo info_;
  std::chrono::nanoseconds next_{0};
  Bytes wire_;
  std::deque<std::uint8_t> arrived_;
};

/// A probe on a noisy line.
struct NoisyProbe {
  /// \param own_options  of the URI; empty: those of the protocol's table
  explicit NoisyProbe(std::string_view protocol, std::string_view own_options = {},
                      NoisyLine::Change change = {}) {
    const auto entry = *find_protocol(protocol);
    const std::string wanted(own_options.empty() ? entry->options : own_options);
    auto owned = std::make_unique<NoisyLine>(host, protocol);
    line = owned.get();
    line->change = std::move(change);
    const auto uri = Uri::parse(wanted.empty() ? "serial:x" : "serial:x?" + wanted);
    UriOptions options(*uri);
    auto opened = DeviceProbe::open(std::move(owned), *entry->make(options),
                                    {.uri = "serial:x",
                                     .protocol = std::string(protocol),
                                     .hint = "the baud rate",
                                     .clock = &host});
    if (opened) probe = std::move(*opened);
    if (!opened) error = opened.error().sentence;
  }
  /// The samples of a time. \param seconds  of virtual time
  std::vector<ProbeSample> read_for(double seconds) {
    std::vector<ProbeSample> heard;
    std::vector<ProbeSample> samples(256);
    const auto end = host.time + units::nanoseconds_from_s(seconds);
    while (host.time < end) {
      const auto count = probe->read(samples, std::chrono::milliseconds{10});
      if (!count) break;
      heard.insert(heard.end(), samples.begin(),
                   samples.begin() + static_cast<std::ptrdiff_t>(*count));
      for (std::string& notice : probe->take_notices()) notices.push_back(std::move(notice));
    }
    return heard;
  }
  [[nodiscard]] bool was_told(std::string_view words) const {
    return std::any_of(notices.begin(), notices.end(), [&](const std::string& notice) {
      return notice.find(words) != std::string::npos;
    });
  }

  VirtualHost host;
  NoisyLine* line = nullptr;
  std::unique_ptr<Probe> probe;
  std::string error;
  std::vector<std::string> notices;
};

}  // namespace merkel
