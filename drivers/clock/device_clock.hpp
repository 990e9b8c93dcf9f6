#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/clock/envelope_line.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// Maps the times of a device's own clock to host time.
///
/// A frame is late by whatever the transport makes of it, never early: the least of (arrival −
/// device time) over a second (at first a quarter) is a point of the lower envelope, and a line
/// through the last 30 of them, less those that were held up, gives offset and rate of the clock,
/// free of jitter, of batches and of stalls. What even the fastest frame takes is no part of that;
/// question and answer (SYNC) tell it: the exchanges with the shortest round trips, their midpoints
/// taken for the host times of the device's answers, move the line. Mapped times never go back, and
/// their distances differ from the device's by a tenth at most, also while the estimate settles.
///
/// A counter that wraps is unwrapped. Which readings can be trusted is ArrivalJudge's business:
/// this class takes what it is given. Real-time: no. Thread: probe.
class DeviceClock {
 public:
  struct Report {
    bool settled = false;     ///< the line has points enough
    double drift_ppm = 0.0;   ///< of the device's clock: positive where it is fast
    double jitter_us = 0.0;   ///< rms distance of the envelope's points from their line
    double latency_us = 0.0;  ///< mean of how late frames arrive after the mapped time
    /// Half of the shortest round trip, the jitter added: the mapped time is that certain. Not set
    /// without SYNC, where the transport's least latency stays unknown.
    std::optional<double> uncertainty_us;
    std::uint64_t restarts = 0;  ///< of the device's clock
  };

  /// \param wrap  after how long the device's counter starts again from 0, where it does
  explicit DeviceClock(std::optional<std::chrono::nanoseconds> wrap = std::nullopt) noexcept
      : wrap_(wrap) {}

  void set_wrap(std::optional<std::chrono::nanoseconds> wrap) noexcept { wrap_ = wrap; }

  /// A device time without its wraps, as the next observe() would return it.
  [[nodiscard]] std::chrono::nanoseconds unwrapped(std::chrono::nanoseconds device_time,
                                                   std::chrono::nanoseconds arrival) const noexcept;
  /// The host time that the present estimate gives an unwrapped device time; nothing before the
  /// first frame. Changes nothing.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> estimate(
      std::chrono::nanoseconds device_time) const noexcept;

  /// Takes note of a frame. Returns its device time, unwrapped.
  /// \param device_time  as on the wire
  std::chrono::nanoseconds observe(std::chrono::nanoseconds device_time,
                                   std::chrono::nanoseconds arrival);
  /// Takes note of a question and its answer. Ignores an answer that disagrees with the estimate
  /// by more than 50 ms.
  void observe(const ClockExchange& exchange);

  /// The host time of an unwrapped device time; later with every call whose argument is later.
  /// \param latest  the mapped time is no later, unless the one before was
  [[nodiscard]] std::chrono::nanoseconds host_time(
      std::chrono::nanoseconds device_time,
      std::chrono::nanoseconds latest = std::chrono::nanoseconds::max());

  /// Forgets the device's time: it starts anew, or another device is there.
  void restart() noexcept;

  [[nodiscard]] Report report() const noexcept;

 private:
  struct Point {
    std::chrono::nanoseconds device{0};
    std::chrono::nanoseconds offset{0};  ///< host − device
  };
  static constexpr std::size_t kPoints = 30;

  [[nodiscard]] double offset_ns(std::chrono::nanoseconds device_time) const noexcept;
  std::chrono::nanoseconds follow(std::chrono::nanoseconds device_time,
                                  std::chrono::nanoseconds arrival);
  [[nodiscard]] std::chrono::nanoseconds interval() const noexcept;
  void close_interval();
  void take_bias(const Point& answer);
  void fit_line();

  std::optional<std::chrono::nanoseconds> wrap_;
  std::uint64_t restarts_ = 0;

  bool running_ = false;
  std::chrono::nanoseconds last_device_{0};
  std::chrono::nanoseconds last_host_{0};

  std::array<Point, kPoints> points_{};  ///< a ring
  std::size_t count_ = 0;
  std::size_t next_ = 0;
  std::optional<Point> least_;  ///< of the interval that is under way
  std::chrono::nanoseconds interval_begin_{0};

  // host − device = origin_.offset + line_(device − origin_.device), less the bias
  Point origin_;
  EnvelopeLine line_;

  double latency_ns_ = 0.0;
  std::uint64_t frames_ = 0;

  struct Exchange {
    Point answer;  ///< as if it had taken half of the round trip
    std::chrono::nanoseconds round_trip{0};
  };
  std::optional<Exchange> exchange_;  ///< the one with the shortest round trip so far
  double bias_ns_ = 0.0;              ///< mean of the line against the exchanges about that short
  std::uint64_t biases_ = 0;

  bool mapped_ = false;
  std::chrono::nanoseconds mapped_device_{0};
  std::chrono::nanoseconds mapped_host_{0};
};

}  // namespace merkel
