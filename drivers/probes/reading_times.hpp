#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "drivers/clock/device_clock.hpp"
#include "drivers/probe.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// When a device's readings were made, in host time: by the device's clock where it has one; the
/// middle between question and answer where it was asked; else by their arrival, those of a batch
/// spread over the time since the batch before. Real-time: no. Thread: probe.
class ReadingTimes {
 public:
  /// Which times readings get: the device's clock mapped to the host's; that clock taken as right,
  /// from the first reading on; or their arrival.
  enum class Rule : std::uint8_t { kMapped, kDevice, kArrival };

  explicit ReadingTimes(Rule rule) noexcept : rule_(rule) {}

  /// \param wrap  after how long the device's counter starts again from 0, where it does
  void set_wrap(std::optional<std::chrono::nanoseconds> wrap) noexcept { clock_.set_wrap(wrap); }
  void observe(std::span<const ClockExchange> exchanges);
  /// Of readings that came together, in their order.
  [[nodiscard]] std::vector<std::chrono::nanoseconds> of(std::span<const DeviceReading> batch);
  /// Fills in what is known of the clock and how certain the times are.
  void describe(DeviceCounts& counts) const;

 private:
  using Time = std::chrono::nanoseconds;

  void add_by_clock(std::span<const DeviceReading> readings, std::vector<Time>& times);
  void add_by_arrival(std::span<const DeviceReading> readings, std::vector<Time>& times);

  Rule rule_;
  DeviceClock clock_;
  bool by_clock_ = false;                       ///< the last batch
  std::optional<std::pair<Time, Time>> start_;  ///< device and host time of the first reading
  Time last_batch_{0};
  double round_trip_us_ = 0.0;
};

}  // namespace merkel
