#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace merkel {

/// Checks each time of a device's clock against the arrival of its frame, so that no wrong time can
/// put a sample where touch would be lost.
///
/// A frame cannot arrive before its measurement, and a clock does not run backwards; such a time is
/// an outlier. If outliers persist for 60 ms, or if frames stay late by more than 25 ms for 60 ms
/// without catching up, the clock has jumped and must be anchored anew. A burst of delayed frames
/// is late but valid. Real-time: no. Thread: probe.
class ArrivalCheck {
 public:
  enum class Arrival : std::uint8_t {
    kGood,
    kOutlier,   ///< the time is wrong: use the arrival time
    kReanchor,  ///< the estimate is wrong: map the clock anew from this frame
  };

  /// \param estimate  estimated host time of the measurement
  /// \param tolerance  largest time that a valid estimate may lie after the arrival
  /// \param settled  whether the mapping is known, not only assumed from the first frames
  Arrival check(std::chrono::nanoseconds estimate, std::chrono::nanoseconds arrival,
                std::chrono::nanoseconds tolerance, bool settled) noexcept;
  /// Resets the state: the clock is mapped again.
  void restart() noexcept;

 private:
  using Time = std::chrono::nanoseconds;
  struct WrongFrames {
    Time since{0};
    std::uint32_t frames = 0;
  };
  /// Frames that are late, in groups: the least lateness of a group is that of its freshest frame,
  /// so that a stall's backlog is not judged by its first frames.
  struct Late {
    Time since{0};
    Time group{0};             ///< arrival of the first frame of the present group
    Time least{0};             ///< lateness in it
    std::uint32_t groups = 0;  ///< before it
    Time peak{0};              ///< largest of their least latenesses
    Time peak_at{0};
  };
  bool late_persists(Time lateness, Time arrival) noexcept;
  bool wrong_persists(Time arrival) noexcept;

  std::optional<Time> last_good_;  ///< estimate
  Time last_arrival_{0};
  Time batch_span_{200'000'000};  ///< since the previous batch; an assumption for the first one
  std::optional<WrongFrames> wrong_;
  std::optional<Late> late_;
};

}  // namespace merkel
