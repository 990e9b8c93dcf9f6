#include "drivers/probes/reading_times.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kWidestBatch{50};  ///< longest span of a batch
constexpr milliseconds kTolerance{20};    ///< at first: largest time after the arrival
constexpr milliseconds kSettledTolerance{2};
constexpr double kJitters = 6.0;    ///< later: the same in units of the settled jitter
constexpr milliseconds kLatest{5};  ///< largest time after the arrival
constexpr milliseconds kOutlierLate{25};

}  // namespace

void ReadingTimes::observe(std::span<const ClockExchange> exchanges) {
  for (const ClockExchange& exchange : exchanges) clock_.observe(exchange);
}

std::vector<std::chrono::nanoseconds> ReadingTimes::of(std::span<const DeviceReading> batch) {
  std::vector<Time> times;
  if (batch.empty()) return times;
  by_clock_ = batch.front().device_time.has_value() && rule_ != Rule::kArrival;
  if (!by_clock_) {
    add_by_arrival(batch, times);
    return times;
  }
  while (!batch.empty()) {
    const auto rebooted = std::find_if(batch.begin() + 1, batch.end(),
                                       [](const DeviceReading& next) { return next.rebooted; });
    if (batch.front().rebooted) {
      restart();
      rates_.restart();
    }
    const auto count = static_cast<std::size_t>(rebooted - batch.begin());
    add_by_clock(batch.first(count), times);
    batch = batch.subspan(count);
  }
  return times;
}

void ReadingTimes::restart() noexcept {
  clock_.restart();
  arrivals_.restart();
  start_.reset();
}

void ReadingTimes::add_by_clock(std::span<const DeviceReading> readings, std::vector<Time>& times) {
  for (const DeviceReading& reading : readings) {
    rates_.observe(clock_.unwrapped(*reading.device_time, reading.arrival), reading.arrival);
  }
  note_rates();
  by_clock_ = rates_.agrees();
  if (!by_clock_) {
    add_by_arrival(readings, times);
    last_time_ = times.back();
    return;
  }
  // The last reading of a batch informs the clock most: check all, then compute the times.
  std::vector<Checked> checked;
  for (const DeviceReading& reading : readings) checked.push_back(check(reading));
  for (const Checked& reading : checked) {
    const Time time = reading.good ? time_of(reading) : time_of_outlier(reading.arrival);
    if (reading.good && time > last_time_) step_ = std::min<Time>(time - last_time_, kWidestBatch);
    last_time_ = time;
    times.push_back(time);
  }
  last_batch_ = readings.back().arrival;
}

ReadingTimes::Checked ReadingTimes::check(const DeviceReading& reading) {
  const Time device = clock_.unwrapped(*reading.device_time, reading.arrival);
  auto estimate = clock_.estimate(device);
  if (rule_ == Rule::kDevice && start_) estimate = start_->second + (device - start_->first);
  const DeviceClock::Report report = clock_.report();
  const Time settled{std::llround(kJitters * report.jitter_us * 1e3)};
  const Time tolerance = report.settled && rule_ == Rule::kMapped
                             ? std::max<Time>(settled, kSettledTolerance)
                             : Time{kTolerance};
  switch (arrivals_.check(estimate.value_or(reading.arrival), reading.arrival, tolerance)) {
    case ArrivalCheck::Verdict::kGood:
      return {.device = clock_.observe(*reading.device_time, reading.arrival),
              .arrival = reading.arrival};
    case ArrivalCheck::Verdict::kOutlier:
      ++outliers_;
      return {.device = device, .arrival = reading.arrival, .good = false};
    case ArrivalCheck::Verdict::kReanchor:
      break;
  }
  ++anchors_;
  rates_.reanchored(reading.arrival);
  restart();
  const Time anchored = clock_.observe(*reading.device_time, reading.arrival);
  static_cast<void>(arrivals_.check(reading.arrival, reading.arrival, tolerance));
  return {.device = anchored, .arrival = reading.arrival};
}

ReadingTimes::Time ReadingTimes::time_of(const Checked& reading) {
  const Time mapped = clock_.host_time(reading.device, reading.arrival + kLatest);
  if (rule_ != Rule::kDevice) return mapped;
  if (!start_) start_ = {reading.device, mapped};
  return start_->second + (reading.device - start_->first);
}

/// One step after the previous reading or, if that is too long ago, at its arrival.
ReadingTimes::Time ReadingTimes::time_of_outlier(Time arrival) const noexcept {
  const Time next = std::min(last_time_ + step_, arrival);
  return arrival - next > kOutlierLate ? arrival : next;
}

void ReadingTimes::note_rates() {
  if (rates_.agrees() == rates_agree_) return;
  rates_agree_ = rates_.agrees();
  restart();
  if (rates_agree_) {
    notices_.emplace_back(
        "its clock agrees with this machine's clock again and is used for the sample times");
    return;
  }
  std::array<char, 256> text{};
  std::snprintf(
      text.data(), text.size(),
      "its clock runs at %.4g times the rate of this machine's clock: samples are timed by "
      "their arrival; check the unit of the device's times, or set clock=arrival",
      rates_.rate());
  notices_.emplace_back(text.data());
}

void ReadingTimes::add_by_arrival(std::span<const DeviceReading> readings,
                                  std::vector<Time>& times) {
  const auto count = static_cast<std::int64_t>(readings.size());
  for (std::int64_t part = 1; part <= count; ++part) {
    const DeviceReading& reading = readings[static_cast<std::size_t>(part - 1)];
    if (reading.requested) {
      const Time trip = reading.arrival - *reading.requested;
      round_trip_us_ += (round_trip_us_ == 0.0 ? 1.0 : 0.05) *
                        (static_cast<double>(trip.count()) * 1e-3 - round_trip_us_);
      times.push_back(*reading.requested + trip / 2);
      continue;
    }
    // They were measured one after the other since the previous batch.
    const Time begin = std::max<Time>(last_batch_, reading.arrival - kWidestBatch);
    times.push_back(begin + (reading.arrival - begin) * part / count);
  }
  last_batch_ = readings.back().arrival;
}

void ReadingTimes::describe(DeviceCounts& counts) const {
  counts.device_clock = by_clock_;
  counts.clock_outliers = outliers_;
  counts.clock_anchors = anchors_;
  counts.clock_rate = rates_.rate();
  counts.clock_mistrusted = !rates_.agrees();
  if (by_clock_) {
    const DeviceClock::Report report = clock_.report();
    counts.drift_ppm = report.drift_ppm;
    counts.jitter_us = report.jitter_us;
    counts.latency_us = report.latency_us;
    counts.uncertainty_us = report.uncertainty_us;
  } else if (round_trip_us_ > 0.0) {
    counts.uncertainty_us = round_trip_us_ / 2.0;
  }
}

}  // namespace merkel
