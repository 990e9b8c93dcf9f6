#include "drivers/probes/reading_times.hpp"

#include <algorithm>

namespace merkel {
namespace {

constexpr std::chrono::milliseconds kWidestBatch{50};  ///< over so much a batch is spread at most

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
      clock_.restart();
      start_.reset();
    }
    const auto count = static_cast<std::size_t>(rebooted - batch.begin());
    add_by_clock(batch.first(count), times);
    batch = batch.subspan(count);
  }
  return times;
}

void ReadingTimes::add_by_clock(std::span<const DeviceReading> readings, std::vector<Time>& times) {
  // The last of a batch tells most about the clock: all of them first, then their times.
  std::vector<Time> observed;
  for (const DeviceReading& reading : readings) {
    observed.push_back(clock_.observe(*reading.device_time, reading.arrival));
  }
  for (const Time device : observed) {
    const Time mapped = clock_.host_time(device);
    if (!start_) start_ = {device, mapped};
    times.push_back(rule_ == Rule::kDevice ? start_->second + (device - start_->first) : mapped);
  }
}

void ReadingTimes::add_by_arrival(std::span<const DeviceReading> readings,
                                  std::vector<Time>& times) {
  const auto count = static_cast<std::int64_t>(readings.size());
  for (std::int64_t part = 1; part <= count; ++part) {
    const DeviceReading& reading = readings[static_cast<std::size_t>(part - 1)];
    if (reading.asked) {
      const Time trip = reading.arrival - *reading.asked;
      round_trip_us_ += (round_trip_us_ == 0.0 ? 1.0 : 0.05) *
                        (static_cast<double>(trip.count()) * 1e-3 - round_trip_us_);
      times.push_back(*reading.asked + trip / 2);
      continue;
    }
    // They were measured one after the other since the batch before.
    const Time begin = std::max<Time>(last_batch_, reading.arrival - kWidestBatch);
    times.push_back(begin + (reading.arrival - begin) * part / count);
  }
  last_batch_ = readings.back().arrival;
}

void ReadingTimes::describe(DeviceCounts& counts) const {
  counts.device_clock = by_clock_;
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
