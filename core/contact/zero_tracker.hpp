#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <limits>

#include "core/realtime_tag.hpp"

namespace merkel {

/// The zero of one force or pressure, which follows the drift of its sensor. It works on the
/// readings alone, so a recording gives the same zeros. Units are those of the readings.
///
/// - Without contact, the zero follows the mean of the readings, at most twice as fast as the
///   largest drift. If it is not known at the start, a first reading within the threshold is the
///   zero.
/// - At the start of a contact, the zero returns to that before the readings rose beyond half of
///   the threshold, at most 2 s before, if that was smaller: what it had absorbed of a slow press
///   comes back. Then it is frozen.
/// - A reading that has fallen by half within 0.5 s and then stays for 1 s at a level that the
///   largest drift explains is released: that level becomes the zero.
/// - A contact is uncertain if it began with the first readings, if it rose no faster than drift,
///   or if it has fallen by half, then stays, and three times the largest drift would explain its
///   level. It is certain again after a release, or, in the last two cases, when it rises.
/// Real-time: yes.
class ZeroTracker {
 public:
  /// What this many times the largest drift would explain may be drift.
  static constexpr double kDoubt = 3.0;

  /// \param threshold  a reading from there above the zero is a contact; > 0, several times the
  ///     noise. \param drift_per_s  the largest drift of the sensor. \param known  the zero at the
  ///     start is 0
  ZeroTracker(double threshold, double drift_per_s, bool known = false) noexcept;

  /// Takes the next reading. \return the zero, also for this reading
  double follow(std::chrono::nanoseconds time, double reading) noexcept MERKEL_REALTIME;
  /// A contact begins with the reading taken last. \return its zero
  double begin_contact() noexcept MERKEL_REALTIME;
  void end_contact() noexcept MERKEL_REALTIME { touching_ = false; }
  /// Starts anew, with a known zero of 0.
  void reset() noexcept MERKEL_REALTIME;

  [[nodiscard]] double zero() const noexcept MERKEL_REALTIME { return zero_; }
  /// Whether the present contact may be drift.
  [[nodiscard]] bool uncertain() const noexcept MERKEL_REALTIME;

 private:
  struct Moment {
    double time_s = 0.0;
    double zero = 0.0;
    double mean = 0.0;
  };
  static constexpr std::size_t kMoments = 64;

  [[nodiscard]] const Moment& before(
      double duration_s, double level = -std::numeric_limits<double>::infinity()) const noexcept;
  void set_zero(double zero) noexcept;
  void remember() noexcept;
  void watch_contact() noexcept;

  double threshold_;
  double drift_per_s_;
  bool known_zero_;
  std::array<Moment, kMoments> moments_{};  ///< the last seconds, every 50 ms
  std::size_t newest_ = 0;
  std::size_t known_ = 0;  ///< of the moments
  bool started_ = false;
  std::chrono::nanoseconds origin_{0};  ///< time of the first reading
  double now_s_ = 0.0;                  ///< since then
  double mean_ = 0.0;                   ///< over 0.1 s
  double fast_ = 0.0;                   ///< over 10 ms
  double exact_ = 0.0;                  ///< the zero; zero_ follows it in small steps
  double zero_ = 0.0;
  // The present contact:
  bool touching_ = false;
  double began_s_ = 0.0;
  double hold_ = 0.0;       ///< the largest mean above the zero since a fall
  bool risen_ = false;      ///< faster than drift
  bool dropped_ = false;    ///< by half within 0.5 s
  bool fell_ = false;       ///< below half, faster than drift
  double fell_at_s_ = 0.0;  ///< the end of that
  bool doubtful_ = false;   ///< drift may explain where it fell to
  double level_ = 0.0;      ///< at which the mean stays,
  double still_since_s_ = 0.0;
};

}  // namespace merkel
