#include "drivers/clock/device_clock.hpp"

#include <algorithm>
#include <cmath>

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr nanoseconds kInterval{1'000'000'000};
constexpr nanoseconds kFirstInterval{250'000'000};  ///< while there are few points
constexpr std::size_t kFew = 8;
constexpr nanoseconds kWrongAnswer{50'000'000};
constexpr std::size_t kEnough = 3;          ///< fewest points for a line
constexpr std::uint64_t kMaxBiases = 1000;  ///< longest window of their mean
constexpr double kMinPace = 0.9;
constexpr double kMaxPace = 1.1;
constexpr double kLatencyForgetting = 1e-3;

}  // namespace

void DeviceClock::restart() noexcept {
  if (running_) ++restarts_;
  running_ = false;
  count_ = next_ = 0;
  least_.reset();
  line_ = {};
  bias_ns_ = latency_ns_ = 0.0;
  frames_ = 0;
  exchange_.reset();
  biases_ = 0;
  // mapped_host_ is kept: host time continues.
  if (mapped_) mapped_device_ = nanoseconds::min();
}

nanoseconds DeviceClock::unwrapped(nanoseconds device_time, nanoseconds host) const noexcept {
  if (!running_ || !wrap_) return device_time;
  // The unwrapped time that is nearest to the expected one.
  const nanoseconds expected = last_device_ + std::max(host - last_host_, nanoseconds{0});
  const nanoseconds ahead = ((device_time - expected) % *wrap_ + *wrap_) % *wrap_;
  return expected + (ahead < *wrap_ / 2 ? ahead : ahead - *wrap_);
}

std::optional<nanoseconds> DeviceClock::estimate(nanoseconds device_time) const noexcept {
  if (!running_) return std::nullopt;
  return device_time + nanoseconds{std::llround(offset_ns(device_time))};
}

nanoseconds DeviceClock::follow(nanoseconds device_time, nanoseconds arrival) {
  nanoseconds device = unwrapped(device_time, arrival);
  if (!running_) {
    running_ = true;
    origin_ = {device_time, arrival - device_time};
    interval_begin_ = last_device_ = device = device_time;
  }
  last_device_ = std::max(device, last_device_);
  last_host_ = arrival;
  return device;
}

nanoseconds DeviceClock::observe(nanoseconds device_time, nanoseconds arrival) {
  const nanoseconds device = follow(device_time, arrival);
  ++frames_;
  if (device - interval_begin_ >= interval()) close_interval();
  const Point point{device, arrival - device};
  if (!least_ || point.offset < least_->offset) least_ = point;
  if (count_ < kEnough) {
    line_.intercept_ns =
        std::min(line_.intercept_ns, static_cast<double>((point.offset - origin_.offset).count()));
  }
  const double late_ns = static_cast<double>(point.offset.count()) - offset_ns(device);
  const double weight = std::max(kLatencyForgetting, 1.0 / static_cast<double>(frames_));
  latency_ns_ += weight * (late_ns - latency_ns_);
  return device;
}

nanoseconds DeviceClock::interval() const noexcept {
  return count_ < kFew ? kFirstInterval : kInterval;
}

void DeviceClock::close_interval() {
  const nanoseconds length = interval();
  const nanoseconds before = points_[(next_ + kPoints - 1) % kPoints].device;
  if (least_ && (count_ == 0 || least_->device > before)) {
    points_[next_] = *least_;
    next_ = (next_ + 1) % kPoints;
    count_ = std::min(count_ + 1, kPoints);
    if (count_ >= kEnough) fit_line();
    if (count_ == kEnough && exchange_ && biases_ == 0) take_bias(exchange_->answer);
  }
  interval_begin_ += (last_device_ - interval_begin_) / length * length;
  least_.reset();
}

void DeviceClock::fit_line() {
  const std::size_t oldest = (next_ + kPoints - count_) % kPoints;
  origin_ = points_[(next_ + kPoints - 1) % kPoints];
  std::array<EnvelopePoint, kPoints> points;
  for (std::size_t i = 0; i < count_; ++i) {
    const Point& point = points_[(oldest + i) % kPoints];
    points[i] = {.x_ns = static_cast<double>((point.device - origin_.device).count()),
                 .y_ns = static_cast<double>((point.offset - origin_.offset).count())};
  }
  line_ = fit_envelope(std::span(points).first(count_), line_.slope);
}

double DeviceClock::offset_ns(nanoseconds device_time) const noexcept {
  if (count_ < kEnough) {
    // The least offset so far, assuming that the device's rate is exact.
    const double least_ns = static_cast<double>(origin_.offset.count()) + line_.intercept_ns;
    return exchange_ ? std::min(least_ns, static_cast<double>(exchange_->answer.offset.count()))
                     : least_ns;
  }
  return static_cast<double>(origin_.offset.count()) + line_.intercept_ns - bias_ns_ +
         line_.slope * static_cast<double>((device_time - origin_.device).count());
}

void DeviceClock::observe(const ClockExchange& exchange) {
  // Not added to the envelope: an answer takes another path through the transport than a sample.
  const nanoseconds answered = unwrapped(exchange.device_sent, exchange.received);
  const auto expected = estimate(answered);
  // Half of a slow round trip does not count as disagreement.
  const nanoseconds slack = kWrongAnswer + (exchange.received - exchange.sent);
  if (expected && (*expected > exchange.received + slack || *expected < exchange.sent - slack)) {
    return;
  }
  const nanoseconds device = follow(exchange.device_sent, exchange.received);
  const nanoseconds busy = exchange.device_sent - exchange.device_received;
  const nanoseconds trip = exchange.received - exchange.sent - std::max(busy, nanoseconds{0});
  if (trip < nanoseconds{0}) return;
  const nanoseconds offset = exchange.received - trip / 2 - device;
  const nanoseconds shortest = exchange_ ? exchange_->round_trip : nanoseconds::max();
  if (trip < shortest) exchange_ = {.answer = {device, offset}, .round_trip = trip};
  if (count_ < kEnough || trip / 5 > shortest / 4) return;
  if (trip < shortest / 5 * 4) biases_ = 0;
  take_bias({device, offset});
}

void DeviceClock::take_bias(const Point& answer) {
  biases_ = std::min(biases_ + 1, kMaxBiases);
  const double bias_ns =
      offset_ns(answer.device) + bias_ns_ - static_cast<double>(answer.offset.count());
  bias_ns_ += (bias_ns - bias_ns_) / static_cast<double>(biases_);
}

nanoseconds DeviceClock::host_time(nanoseconds device_time, nanoseconds latest) {
  const nanoseconds mapped =
      device_time + nanoseconds{static_cast<std::int64_t>(std::llround(offset_ns(device_time)))};
  nanoseconds host = mapped;
  if (mapped_ && mapped_device_ == nanoseconds::min()) {
    host = std::max(mapped, mapped_host_ + nanoseconds{1});
  } else if (mapped_) {
    const auto step =
        static_cast<double>(std::max((device_time - mapped_device_).count(), std::int64_t{1}));
    host = mapped_host_ +
           nanoseconds{std::llround(std::clamp(static_cast<double>((mapped - mapped_host_).count()),
                                               kMinPace * step, kMaxPace * step))};
    host = std::max(host, mapped_host_ + nanoseconds{1});
  }
  if (host > latest) host = mapped_ ? std::max(latest, mapped_host_ + nanoseconds{1}) : latest;
  mapped_ = true;
  mapped_device_ = device_time;
  mapped_host_ = host;
  return host;
}

DeviceClock::Report DeviceClock::report() const noexcept {
  Report report{.settled = count_ >= kEnough,
                .drift_ppm = -line_.slope * 1e6,
                .jitter_us = line_.rms_ns * 1e-3,
                .latency_us = latency_ns_ * 1e-3,
                .uncertainty_us = std::nullopt,
                .restarts = restarts_};
  if (exchange_) {
    report.uncertainty_us =
        static_cast<double>(exchange_->round_trip.count()) * 0.5e-3 + report.jitter_us;
  }
  return report;
}

}  // namespace merkel
