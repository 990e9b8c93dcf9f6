#include "drivers/clock/device_clock.hpp"

#include <algorithm>
#include <cmath>

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr nanoseconds kSecond{1'000'000'000};
constexpr nanoseconds kSlack{2'000'000'000};  ///< a device's clock may seem to be so much ahead
constexpr std::size_t kEnough = 3;            ///< points that make a line
constexpr std::uint64_t kMostBiases = 1000;   ///< over which their mean is taken
constexpr double kLeastPace = 0.9;
constexpr double kMostPace = 1.1;
constexpr double kLatencyForgetting = 1e-3;

}  // namespace

void DeviceClock::restart() noexcept {
  if (running_) ++restarts_;
  running_ = false;
  count_ = next_ = 0;
  least_.reset();
  intercept_ns_ = slope_ = rms_ns_ = bias_ns_ = latency_ns_ = 0.0;
  frames_ = 0;
  round_trip_.reset();
  biases_ = 0;
  // mapped_host_ stays: host time goes on.
  if (mapped_) mapped_device_ = nanoseconds::min();
}

nanoseconds DeviceClock::unwrap(nanoseconds device_time, nanoseconds host) const noexcept {
  if (!running_ || !wrap_) return device_time;
  // The reading that is nearest to where the clock must be by now.
  const nanoseconds expected = last_device_ + std::max(host - last_host_, nanoseconds{0});
  const nanoseconds ahead = ((device_time - expected) % *wrap_ + *wrap_) % *wrap_;
  return expected + (ahead < *wrap_ / 2 ? ahead : ahead - *wrap_);
}

/// Unwraps a time of the device, and notices when it has started anew.
nanoseconds DeviceClock::follow(nanoseconds device_time, nanoseconds arrival) {
  nanoseconds device = unwrap(device_time, arrival);
  if (running_ &&
      (device < last_device_ - kSlack || device > last_device_ + (arrival - last_host_) + kSlack)) {
    restart();
  }
  if (!running_) {
    running_ = true;
    origin_ = {device_time, arrival - device_time};
    second_ = last_device_ = device = device_time;
  }
  last_device_ = std::max(device, last_device_);
  last_host_ = arrival;
  return device;
}

nanoseconds DeviceClock::observe(nanoseconds device_time, nanoseconds arrival) {
  const nanoseconds device = follow(device_time, arrival);
  ++frames_;
  if (device - second_ >= kSecond) close_second();
  const Point point{device, arrival - device};
  if (!least_ || point.offset < least_->offset) least_ = point;
  if (count_ < kEnough) {
    // Until there is a line, the least offset so far, and the device's rate taken as right.
    intercept_ns_ =
        std::min(intercept_ns_, static_cast<double>((point.offset - origin_.offset).count()));
  }
  const double late_ns = static_cast<double>(point.offset.count()) - offset_ns(device);
  const double weight = std::max(kLatencyForgetting, 1.0 / static_cast<double>(frames_));
  latency_ns_ += weight * (late_ns - latency_ns_);
  return device;
}

void DeviceClock::close_second() {
  if (least_) {
    points_[next_] = *least_;
    next_ = (next_ + 1) % kPoints;
    count_ = std::min(count_ + 1, kPoints);
    if (count_ >= kEnough) fit_line();
  }
  second_ += (last_device_ - second_) / kSecond * kSecond;
  least_.reset();
}

void DeviceClock::fit_line() {
  const Point& last = points_[(next_ + kPoints - 1) % kPoints];
  const auto x_of = [&](const Point& point) {
    return static_cast<double>((point.device - last.device).count());
  };
  const auto y_of = [&](const Point& point) {
    return static_cast<double>((point.offset - last.offset).count());
  };
  const auto n = static_cast<double>(count_);
  double mean_x = 0.0;
  double mean_y = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    mean_x += x_of(points_[i]) / n;
    mean_y += y_of(points_[i]) / n;
  }
  double xx = 0.0;
  double xy = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    xx += (x_of(points_[i]) - mean_x) * (x_of(points_[i]) - mean_x);
    xy += (x_of(points_[i]) - mean_x) * (y_of(points_[i]) - mean_y);
  }
  slope_ = xx > 0.0 ? xy / xx : 0.0;
  origin_ = last;
  intercept_ns_ = mean_y - slope_ * mean_x;
  double squares = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const double rest = y_of(points_[i]) - intercept_ns_ - slope_ * x_of(points_[i]);
    squares += rest * rest / n;
  }
  rms_ns_ = std::sqrt(squares);
}

double DeviceClock::offset_ns(nanoseconds device_time) const noexcept {
  return static_cast<double>(origin_.offset.count()) + intercept_ns_ - bias_ns_ +
         slope_ * static_cast<double>((device_time - origin_.device).count());
}

void DeviceClock::observe(const ClockExchange& exchange) {
  // No point of the envelope: an answer comes at another phase of the transport than a sample.
  const nanoseconds device = follow(exchange.device_sent, exchange.received);
  const nanoseconds busy = exchange.device_sent - exchange.device_received;
  const nanoseconds trip = exchange.received - exchange.sent - std::max(busy, nanoseconds{0});
  if (trip < nanoseconds{0}) return;
  const nanoseconds offset = exchange.received - trip / 2 - device;
  if (count_ < kEnough) {
    intercept_ns_ = std::min(intercept_ns_, static_cast<double>((offset - origin_.offset).count()));
    return;
  }
  if (!round_trip_ || 5 * trip < 4 * *round_trip_) biases_ = 0;
  round_trip_ = std::min(round_trip_.value_or(trip), trip);
  if (4 * trip > 5 * *round_trip_) return;
  biases_ = std::min(biases_ + 1, kMostBiases);
  const double bias_ns = offset_ns(device) + bias_ns_ - static_cast<double>(offset.count());
  bias_ns_ += (bias_ns - bias_ns_) / static_cast<double>(biases_);
}

nanoseconds DeviceClock::host_time(nanoseconds device_time) {
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
                                               kLeastPace * step, kMostPace * step))};
    host = std::max(host, mapped_host_ + nanoseconds{1});
  }
  mapped_ = true;
  mapped_device_ = device_time;
  mapped_host_ = host;
  return host;
}

DeviceClock::Report DeviceClock::report() const noexcept {
  Report report{.settled = count_ >= kEnough,
                .drift_ppm = -slope_ * 1e6,
                .jitter_us = rms_ns_ * 1e-3,
                .latency_us = latency_ns_ * 1e-3,
                .uncertainty_us = std::nullopt,
                .restarts = restarts_};
  if (round_trip_) {
    report.uncertainty_us = static_cast<double>(round_trip_->count()) * 0.5e-3 + report.jitter_us;
  }
  return report;
}

}  // namespace merkel
