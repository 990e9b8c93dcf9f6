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
/// The transport delays frames and never advances them. The least (arrival − device time) within a
/// second (at first, a quarter) is a point of the lower envelope. A line through the last 30
/// points, excluding delayed ones, gives offset and rate of the clock, free of jitter, batches and
/// stalls. The latency of the fastest frame cannot be seen this way. A SYNC exchange measures it:
/// the midpoint of a round trip is the host time of the device's answer, and the exchanges with the
/// shortest round trips shift the line. Mapped times never go back, and their intervals differ from
/// the device's by at most a tenth, even while the estimate settles.
///
/// A wrapping counter is unwrapped. ArrivalCheck decides which readings are valid; this class
/// accepts all that it is given. Real-time: no. Thread: probe.
class DeviceClock {
 public:
  struct Report {
    bool settled = false;     ///< the line has enough points
    double drift_ppm = 0.0;   ///< of the device's clock; positive: fast
    double jitter_us = 0.0;   ///< rms distance of the envelope's points from their line
    double latency_us = 0.0;  ///< mean of arrival − mapped time
    /// Half of the shortest round trip plus the jitter: uncertainty of the mapped time. Not set
    /// without SYNC, because the transport's least latency is then unknown.
    std::optional<double> uncertainty_us;
    std::uint64_t restarts = 0;  ///< of the device's clock
  };

  /// \param wrap  period after which the device's counter wraps to 0, if it does
  explicit DeviceClock(std::optional<std::chrono::nanoseconds> wrap = std::nullopt) noexcept
      : wrap_(wrap) {}

  void set_wrap(std::optional<std::chrono::nanoseconds> wrap) noexcept { wrap_ = wrap; }

  /// False if the clock is known by answers alone, or not at all.
  [[nodiscard]] bool has_frames() const noexcept { return frames_ > 0; }
  /// An unwrapped device time, as the next observe() would return it.
  [[nodiscard]] std::chrono::nanoseconds unwrapped(std::chrono::nanoseconds device_time,
                                                   std::chrono::nanoseconds arrival) const noexcept;
  /// The host time of an unwrapped device time by the present estimate; empty before the first
  /// frame. Does not change the state.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> estimate(
      std::chrono::nanoseconds device_time) const noexcept;

  /// Adds a frame to the estimate. Returns its unwrapped device time.
  /// \param device_time  as on the wire
  std::chrono::nanoseconds observe(std::chrono::nanoseconds device_time,
                                   std::chrono::nanoseconds arrival);
  /// Adds a SYNC exchange to the estimate. Ignores an answer that differs from the estimate
  /// by more than 50 ms.
  void observe(const ClockExchange& exchange);

  /// The host time of an unwrapped device time; increases strictly with its argument.
  /// \param latest  upper limit of the mapped time, unless the previous one exceeds it
  [[nodiscard]] std::chrono::nanoseconds host_time(
      std::chrono::nanoseconds device_time,
      std::chrono::nanoseconds latest = std::chrono::nanoseconds::max());

  /// Resets the estimate after a restart or a change of the device.
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
  std::optional<Point> least_;  ///< of the current interval
  std::chrono::nanoseconds interval_begin_{0};

  // host − device = origin_.offset + line_(device − origin_.device) − bias
  Point origin_;
  EnvelopeLine line_;

  double latency_ns_ = 0.0;
  std::uint64_t frames_ = 0;

  struct Exchange {
    Point answer;  ///< assuming half of the round trip
    std::chrono::nanoseconds round_trip{0};
  };
  std::optional<Exchange> exchange_;  ///< the one with the shortest round trip so far
  double bias_ns_ = 0.0;              ///< mean of line − exchange, for the short exchanges
  std::uint64_t biases_ = 0;

  bool mapped_ = false;
  std::chrono::nanoseconds mapped_device_{0};
  std::chrono::nanoseconds mapped_host_{0};
};

}  // namespace merkel
