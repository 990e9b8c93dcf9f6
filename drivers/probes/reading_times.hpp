#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/clock/arrival_judge.hpp"
#include "drivers/clock/device_clock.hpp"
#include "drivers/clock/rate_watch.hpp"
#include "drivers/probe.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// When a device's readings were made, in host time: by the device's clock where it has one; the
/// middle between question and answer where it was asked; else by their arrival, those of a batch
/// spread over the time since the batch before.
///
/// Every time of a device's clock is judged against the arrival of its reading (ArrivalJudge,
/// RateWatch): a wrong one is counted and replaced by the arrival, a clock that has jumped is
/// mapped from scratch, and while its rate is not the host's the arrivals are used and the user is
/// told. Real-time: no. Thread: probe.
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
  /// Sentences for the user since the last call.
  [[nodiscard]] std::vector<std::string> take_notices() { return std::exchange(notices_, {}); }

 private:
  using Time = std::chrono::nanoseconds;

  /// A reading of a batch whose clock has been judged.
  struct Judged {
    Time device{0};  ///< unwrapped
    Time arrival{0};
    bool good = true;
  };
  void restart() noexcept;
  void add_by_clock(std::span<const DeviceReading> readings, std::vector<Time>& times);
  [[nodiscard]] Judged judge(const DeviceReading& reading);
  [[nodiscard]] Time time_of(const Judged& reading);
  [[nodiscard]] Time time_of_outlier(Time arrival) const noexcept;
  void note_rates();
  void add_by_arrival(std::span<const DeviceReading> readings, std::vector<Time>& times);

  Rule rule_;
  DeviceClock clock_;
  ArrivalJudge judge_;
  RateWatch rates_;
  bool by_clock_ = false;                       ///< the last batch
  bool rates_agree_ = true;                     ///< as the user was told
  std::optional<std::pair<Time, Time>> start_;  ///< device and host time of the first reading
  Time last_batch_{0};
  Time last_time_{0};     ///< of any reading
  Time step_{1'000'000};  ///< between the last two good times
  double round_trip_us_ = 0.0;
  std::uint64_t outliers_ = 0;
  std::uint64_t anchors_ = 0;  ///< times that the clock was mapped from scratch
  std::vector<std::string> notices_;
};

}  // namespace merkel
