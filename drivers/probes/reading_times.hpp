#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/clock/arrival_check.hpp"
#include "drivers/clock/device_clock.hpp"
#include "drivers/clock/rate_watch.hpp"
#include "drivers/probe.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// The times of a device's readings in host time. Taken from the device's clock if it has one; else
/// the midpoint between request and answer; else the arrival, with the readings of a batch spread
/// over the time since the previous batch.
///
/// Every time of a device's clock is checked against the arrival of its reading (ArrivalCheck,
/// RateWatch). A wrong time is counted and replaced by the arrival. A clock that has jumped is
/// mapped again. While the clock's rate is wrong, arrivals are used and the user is notified.
/// Real-time: no. Thread: probe.
class ReadingTimes {
 public:
  /// Source of the times: the device's clock mapped to the host's; the device's clock unmapped,
  /// from the first reading on; the arrival; or the device's times as they are, because they are on
  /// the host's clock already (they are mapped if the arrivals show that they are not); or the
  /// device's clock mapped without a check by the arrivals, because a late reader finds every
  /// reading in the device's buffer; or the device's times as they are, whatever the host's clock,
  /// but never back.
  enum class Rule : std::uint8_t { kMapped, kDevice, kArrival, kHost, kBuffered, kUnmapped };

  explicit ReadingTimes(Rule rule) noexcept : rule_(rule) {}

  /// \param wrap  period after which the device's counter wraps to 0, if it does
  void set_wrap(std::optional<std::chrono::nanoseconds> wrap) noexcept { clock_.set_wrap(wrap); }
  void observe(std::span<const ClockExchange> exchanges);
  /// The times of the readings of a batch, in their order.
  [[nodiscard]] std::vector<std::chrono::nanoseconds> of(std::span<const DeviceReading> batch);
  /// The host time of an edge that the device reports with a time of its clock; by its arrival, if
  /// that clock is not used. Ask after the readings that arrived with it.
  [[nodiscard]] std::chrono::nanoseconds of_edge(std::chrono::nanoseconds device_time,
                                                 std::chrono::nanoseconds arrival) const;
  /// Fills in the counters of the clock and the uncertainty of the times.
  void describe(DeviceCounts& counts) const;
  /// Messages for the user since the last call.
  [[nodiscard]] std::vector<std::string> take_notices() { return std::exchange(notices_, {}); }

 private:
  using Time = std::chrono::nanoseconds;

  /// A reading of a batch with its checked device time.
  struct Checked {
    Time device{0};  ///< unwrapped
    Time arrival{0};
    bool good = true;
  };
  void restart() noexcept;
  void add_unmapped(std::span<const DeviceReading> readings, std::vector<Time>& times);
  void add_by_clock(std::span<const DeviceReading> readings, std::vector<Time>& times);
  [[nodiscard]] bool is_ahead_of_next(std::span<const DeviceReading> readings,
                                      const std::vector<Checked>& before) const noexcept;
  void check_answers(const DeviceReading& freshest);
  [[nodiscard]] Checked check(const DeviceReading& reading);
  [[nodiscard]] Checked check_host_time(const DeviceReading& reading);
  [[nodiscard]] Time time_of(const Checked& reading);
  [[nodiscard]] Time time_of_outlier(Time arrival) const noexcept;
  void note_rates();
  void note_wrong_times(std::uint64_t count, Time arrival);
  [[nodiscard]] Time span_of(std::size_t readings, Time arrival) noexcept;
  void add_by_arrival(std::span<const DeviceReading> readings, std::vector<Time>& times);

  Rule rule_;
  DeviceClock clock_;
  ArrivalCheck arrivals_;
  RateWatch rates_;
  bool by_clock_ = false;                       ///< of the last batch
  bool rates_agree_ = true;                     ///< as last reported to the user
  std::optional<std::pair<Time, Time>> start_;  ///< device and host time of the first reading
  Time shift_{0};                               ///< of unmapped times, since the clock went back
  std::optional<Time> foreign_since_;  ///< arrival of the first of several impossible host times
  Time last_batch_{0};
  Time last_time_{0};         ///< of any reading
  Time step_{1'000'000};      ///< between the last two good times
  double interval_ns_ = 0.0;  ///< mean between readings, by their arrivals; 0: not known
  std::uint64_t stamps_ = 0;
  double stamp_age_us_ = 0.0;  ///< mean age of the host times on arrival
  double round_trip_us_ = 0.0;
  std::uint64_t outliers_ = 0;
  std::optional<Time> wrong_time_;  ///< arrival of the last reading with an impossible time
  std::uint64_t anchors_ = 0;       ///< times that the clock was mapped again
  std::vector<std::string> notices_;
};

}  // namespace merkel
