#include "drivers/probes/reading_times.hpp"

#include <algorithm>
#include <cmath>

#include "core/printed.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kWidestBatch{50};  ///< longest span of a batch
constexpr milliseconds kTolerance{20};    ///< at first: largest time after the arrival
constexpr milliseconds kSettledTolerance{2};
constexpr milliseconds kLargestTolerance{100};
constexpr double kJitters = 6.0;    ///< later: the same in units of the settled jitter
constexpr milliseconds kLatest{5};  ///< largest time after the arrival
constexpr milliseconds kOutlierLate{25};
constexpr milliseconds kSpikeAhead{2};           ///< largest step back between readings
constexpr std::chrono::seconds kQuietAgain{10};  ///< between two notices of wrong times
constexpr nanoseconds kRateWindow = std::chrono::seconds{2};
constexpr double kSpanMargin = 1.25;
constexpr milliseconds kWrongAnswers{50};      ///< between an answer of the clock and a reading
constexpr double kAgeWeight = 1e-3;            ///< of a host time in the mean age
constexpr milliseconds kOldestHostTime{2000};  ///< before the arrival
constexpr milliseconds kForeign{60};  ///< impossible host times for that long: another clock

}  // namespace

void ReadingTimes::observe(std::span<const ClockExchange> exchanges) {
  for (const ClockExchange& exchange : exchanges) clock_.observe(exchange);
}

std::vector<std::chrono::nanoseconds> ReadingTimes::of(std::span<const DeviceReading> batch) {
  std::vector<Time> times;
  if (batch.empty()) return times;
  const auto wrong = std::count_if(batch.begin(), batch.end(),
                                   [](const DeviceReading& next) { return next.wrong_time; });
  if (wrong > 0) note_wrong_times(static_cast<std::uint64_t>(wrong), batch.back().arrival);
  if (rule_ == Rule::kUnmapped) {
    add_unmapped(batch, times);
    return times;
  }
  by_clock_ = rule_ != Rule::kArrival &&
              std::any_of(batch.begin(), batch.end(),
                          [](const DeviceReading& next) { return next.device_time.has_value(); });
  if (!by_clock_) {
    add_by_arrival(batch, times);
    return times;
  }
  while (!batch.empty()) {
    const auto rebooted = std::find_if(batch.begin() + 1, batch.end(),
                                       [](const DeviceReading& next) { return next.rebooted; });
    if (batch.front().rebooted) {
      restart();
      rates_.reanchored(batch.front().arrival);
    }
    const auto count = static_cast<std::size_t>(rebooted - batch.begin());
    add_by_clock(batch.first(count), times);
    batch = batch.subspan(count);
  }
  return times;
}

std::chrono::nanoseconds ReadingTimes::of_edge(Time device_time, Time arrival) const {
  if (!by_clock_) return arrival;
  if (rule_ == Rule::kUnmapped) return clock_.unwrapped(device_time, Time{0}) + shift_;
  const Time device = clock_.unwrapped(device_time, arrival);
  const auto mapped = rule_ == Rule::kDevice && start_ ? start_->second + (device - start_->first)
                                                       : clock_.estimate(device).value_or(arrival);
  return std::min(mapped, arrival);
}

void ReadingTimes::restart() noexcept {
  clock_.restart();
  arrivals_.restart();
  start_.reset();
}

/// As they are. After one that no clock can have, and where the clock goes back, they go on one
/// step after the reading before.
void ReadingTimes::add_unmapped(std::span<const DeviceReading> readings, std::vector<Time>& times) {
  by_clock_ = true;
  std::vector<Checked> checked;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const auto& device_time = readings[i].device_time;
    const bool good = device_time && !is_ahead_of_next(readings.subspan(i), checked);
    Time time = last_time_ + step_;
    if (good) {
      if (readings[i].rebooted) clock_.restart();
      const Time device = clock_.observe(*device_time, Time{0});
      const Time back = last_time_ - (device + shift_);
      if (start_ && back > kSpikeAhead) {
        ++anchors_;
        shift_ += back + step_;
        notices_.push_back(
            printed("its clock went back by %.3g s: its times go on after those before, as if it "
                    "had not",
                    units::s_from(back)));
      }
      time = device + shift_;
      if (start_ && time > last_time_) step_ = std::min<Time>(time - last_time_, kWidestBatch);
      if (!start_) start_ = {device, time};
      checked.push_back({.device = *device_time});
    } else if (device_time) {
      ++outliers_;
    }
    last_time_ = start_ ? std::max(last_time_, time) : time;
    times.push_back(time);
  }
}

void ReadingTimes::add_by_clock(std::span<const DeviceReading> readings, std::vector<Time>& times) {
  for (const DeviceReading& reading : readings) {
    if (!reading.device_time || rule_ == Rule::kBuffered) continue;
    rates_.observe(clock_.unwrapped(*reading.device_time, reading.arrival), reading.arrival);
  }
  note_rates();
  by_clock_ = rates_.agrees();
  if (!by_clock_) {
    add_by_arrival(readings, times);
    last_time_ = times.back();
    return;
  }
  check_answers(readings.back());
  // The last reading of a batch informs the clock most: check all, then compute the times.
  std::vector<Checked> checked;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (is_ahead_of_next(readings.subspan(i), checked)) {
      ++outliers_;
      checked.push_back({.arrival = readings[i].arrival, .good = false});
      continue;
    }
    checked.push_back(check(readings[i]));
  }
  for (const Checked& reading : checked) {
    const Time time = reading.good ? time_of(reading) : time_of_outlier(reading.arrival);
    if (reading.good && time > last_time_) step_ = std::min<Time>(time - last_time_, kWidestBatch);
    last_time_ = time;
    times.push_back(time);
  }
  static_cast<void>(span_of(readings.size(), readings.back().arrival));
  last_batch_ = readings.back().arrival;
}

/// Before the first reading, the clock is known by the device's answers (SYNC) alone. If these
/// put even the freshest reading far from its arrival, they are wrong.
void ReadingTimes::check_answers(const DeviceReading& freshest) {
  if (rule_ == Rule::kHost || clock_.has_frames() || !freshest.device_time) return;
  const auto estimate = clock_.estimate(clock_.unwrapped(*freshest.device_time, freshest.arrival));
  if (!estimate || std::chrono::abs(freshest.arrival - *estimate) <= kWrongAnswers) return;
  restart();
  rates_.reanchored(freshest.arrival);
  ++anchors_;
  notices_.emplace_back(
      "its answers about its clock contradict the times of its samples and are not used; check its "
      "firmware");
}

/// Whether the next reading of the batch shows that the first one's time is wrong: the next time
/// lies before it, but not before the one that precedes it.
bool ReadingTimes::is_ahead_of_next(std::span<const DeviceReading> readings,
                                    const std::vector<Checked>& before) const noexcept {
  if (readings.size() < 2 || !readings[0].device_time || !readings[1].device_time) return false;
  const Time time = clock_.unwrapped(*readings[0].device_time, readings[0].arrival);
  const Time next = clock_.unwrapped(*readings[1].device_time, readings[1].arrival);
  const bool follows = before.empty() || !before.back().good || before.back().device <= next;
  return time > next + kSpikeAhead && follows;
}

ReadingTimes::Checked ReadingTimes::check_host_time(const DeviceReading& reading) {
  const Time stamp = *reading.device_time;
  const bool good =
      stamp <= reading.arrival + kLatest && stamp >= reading.arrival - kOldestHostTime;
  if (good) {
    foreign_since_.reset();
    const double weight = std::max(kAgeWeight, 1.0 / static_cast<double>(++stamps_));
    stamp_age_us_ += weight * (units::us_from(reading.arrival - stamp) - stamp_age_us_);
    return {.device = stamp, .arrival = reading.arrival};
  }
  ++outliers_;
  if (!foreign_since_) foreign_since_ = reading.arrival;
  if (reading.arrival - *foreign_since_ >= kForeign) {
    rule_ = Rule::kMapped;
    restart();
    notices_.emplace_back(
        "its times are not on this machine's clock: they are mapped to it by their arrival");
  }
  return {.device = stamp, .arrival = reading.arrival, .good = false};
}

ReadingTimes::Checked ReadingTimes::check(const DeviceReading& reading) {
  if (!reading.device_time) return {.arrival = reading.arrival, .good = false};
  if (rule_ == Rule::kHost) return check_host_time(reading);
  if (rule_ == Rule::kBuffered) {
    return {.device = clock_.observe(*reading.device_time, reading.arrival),
            .arrival = reading.arrival};
  }
  const Time device = clock_.unwrapped(*reading.device_time, reading.arrival);
  auto estimate = clock_.estimate(device);
  if (rule_ == Rule::kDevice && start_) estimate = start_->second + (device - start_->first);
  const DeviceClock::Report report = clock_.report();
  const Time settled{std::llround(kJitters * report.jitter_us * 1e3)};
  const Time tolerance = report.settled && rule_ == Rule::kMapped
                             ? std::clamp<Time>(settled, kSettledTolerance, kLargestTolerance)
                             : Time{kTolerance};
  switch (arrivals_.check(estimate.value_or(reading.arrival), reading.arrival, tolerance,
                          report.settled)) {
    case ArrivalCheck::Arrival::kGood:
      return {.device = clock_.observe(*reading.device_time, reading.arrival),
              .arrival = reading.arrival};
    case ArrivalCheck::Arrival::kOutlier:
      ++outliers_;
      return {.device = device, .arrival = reading.arrival, .good = false};
    case ArrivalCheck::Arrival::kReanchor:
      break;
  }
  ++anchors_;
  rates_.reanchored(reading.arrival);
  restart();
  const Time anchored = clock_.observe(*reading.device_time, reading.arrival);
  static_cast<void>(arrivals_.check(reading.arrival, reading.arrival, tolerance, false));
  return {.device = anchored, .arrival = reading.arrival};
}

ReadingTimes::Time ReadingTimes::time_of(const Checked& reading) {
  if (rule_ == Rule::kHost) return reading.device;
  const Time mapped = clock_.host_time(reading.device, reading.arrival + kLatest);
  if (rule_ != Rule::kDevice) return mapped;
  if (!start_) start_ = {reading.device, mapped};
  return start_->second + (reading.device - start_->first);
}

/// One step after the previous reading; at its arrival if it cannot be that old, because it was
/// measured after the previous batch.
ReadingTimes::Time ReadingTimes::time_of_outlier(Time arrival) const noexcept {
  if (last_time_ == Time{0}) return arrival;  // the first reading
  const Time next = std::min(last_time_ + step_, arrival);
  return next < std::min(last_batch_, arrival) - kOutlierLate ? arrival : next;
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
  notices_.push_back(
      printed("its clock runs at %.4g times the rate of this machine's clock: samples are timed by "
              "their arrival; check the unit of the device's times, or set clock=arrival",
              rates_.rate()));
}

void ReadingTimes::note_wrong_times(std::uint64_t count, Time arrival) {
  outliers_ += count;
  if (!wrong_time_ || arrival - *wrong_time_ > kQuietAgain) {
    const std::string instead = rule_ == Rule::kUnmapped
                                    ? "their samples follow one step after those before"
                                    : "their samples are timed by their arrival";
    notices_.push_back("it sends times that no clock can have: " + instead +
                       "; check the unit of the time column");
  }
  wrong_time_ = arrival;
}

/// The longest time in which a batch can have been measured, by the rate so far.
ReadingTimes::Time ReadingTimes::span_of(std::size_t readings, Time arrival) noexcept {
  const auto count = static_cast<double>(readings);
  const auto elapsed_ns = static_cast<double>((arrival - last_batch_).count());
  if (last_batch_.count() != 0 && elapsed_ns > 0.0 && arrival - last_batch_ < kRateWindow) {
    const double weight =
        interval_ns_ == 0.0 ? 1.0
                            : elapsed_ns / (elapsed_ns + static_cast<double>(kRateWindow.count()));
    interval_ns_ += weight * (elapsed_ns / count - interval_ns_);
  }
  return std::max<Time>(kWidestBatch, Time{std::llround(kSpanMargin * count * interval_ns_)});
}

void ReadingTimes::add_by_arrival(std::span<const DeviceReading> readings,
                                  std::vector<Time>& times) {
  if (readings.empty()) return;
  const auto count = static_cast<std::int64_t>(readings.size());
  const Time span = span_of(readings.size(), readings.back().arrival);
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
    const Time begin = std::max<Time>(last_batch_, reading.arrival - span);
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
  if (by_clock_ && rule_ == Rule::kHost) {
    counts.latency_us = stamp_age_us_;
  } else if (by_clock_ && rule_ != Rule::kUnmapped) {
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
