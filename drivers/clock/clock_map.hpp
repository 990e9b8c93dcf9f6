#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <vector>

namespace merkel {

/// One instant on two clocks.
struct ClockReading {
  std::chrono::nanoseconds from{0};
  std::chrono::nanoseconds to{0};
};

/// Converts the times of one clock to another: linearly between readings of both, and beyond them
/// at the rate of the nearest two. The default is the identity.
class ClockMap {
 public:
  using Time = std::chrono::nanoseconds;

  ClockMap() = default;
  explicit ClockMap(Time offset) : knots_{{.from = Time{0}, .to = offset}} {}
  /// \param readings  of at least one instant; those that do not increase on both clocks are left
  /// out
  explicit ClockMap(const std::vector<ClockReading>& readings);

  [[nodiscard]] Time operator()(Time from) const noexcept;
  [[nodiscard]] ClockMap inverse() const;
  /// First this map, then `next`.
  [[nodiscard]] ClockMap then(const ClockMap& next) const;
  /// The instants between which it is linear. Empty: the identity.
  [[nodiscard]] const std::vector<ClockReading>& readings() const noexcept { return knots_; }
  /// Of a straight line each.
  [[nodiscard]] std::size_t pieces() const noexcept {
    return knots_.size() < 3 ? 1 : knots_.size() - 1;
  }
  /// By how much the second clock is faster over all readings, as a fraction.
  [[nodiscard]] double rate() const noexcept;
  /// The largest of that between two readings, in magnitude.
  [[nodiscard]] double largest_rate() const noexcept;

 private:
  std::vector<ClockReading> knots_;  ///< increasing on both clocks; empty: the identity
};

/// Clocks aligned by events that both have seen.
struct ClockFit {
  ClockMap map;
  /// How far a converted time may be off; empty with one event.
  std::optional<std::chrono::nanoseconds> residual;
};

/// Fits offset and rate by least squares; where the events themselves are predicted better by their
/// neighbours than by one line, piece by piece. The residual is the largest error with which an
/// event is predicted by the others, and grows away from the events: at the uncertainty of the
/// rate, and by 1 ppm of the time, as oscillators wander. Events that need clocks to differ by more
/// than 1000 ppm give the mean offset alone.
/// \param events  at least one, in order of time
/// \param first, last  the times to convert
[[nodiscard]] ClockFit fit_clocks(const std::vector<ClockReading>& events,
                                  std::chrono::nanoseconds first, std::chrono::nanoseconds last);

}  // namespace merkel
