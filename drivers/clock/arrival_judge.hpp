#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace merkel {

/// Judges each time that a device's clock gives against the arrival of its frame, so that no time,
/// whatever its size, can put a sample where touch would be lost.
///
/// A frame cannot arrive before it was measured, and a clock does not go back: such a time is an
/// outlier. Outliers that go on for 60 ms, or frames that stay late by more than 25 ms for 60 ms
/// without catching up, are a clock that has jumped: it must be anchored anew. A burst of frames
/// that were held up is late and good. Real-time: no. Thread: probe.
class ArrivalJudge {
 public:
  enum class Verdict : std::uint8_t {
    kGood,
    kOutlier,   ///< the time is wrong: use the arrival
    kReanchor,  ///< the estimate is wrong: map the clock from scratch, beginning with this frame
  };

  /// \param estimate  host time of the measurement, by the estimate so far
  /// \param tolerance  by how much a good estimate may lie after the arrival
  Verdict judge(std::chrono::nanoseconds estimate, std::chrono::nanoseconds arrival,
                std::chrono::nanoseconds tolerance) noexcept;
  /// The clock is mapped from scratch.
  void restart() noexcept;

 private:
  using Time = std::chrono::nanoseconds;
  struct Run {
    Time since{0};
    Time lateness{0};  ///< of its first frame
    std::uint32_t frames = 0;
  };
  static bool goes_on(std::optional<Run>& run, Time lateness, Time arrival) noexcept;

  std::optional<Time> last_good_;  ///< estimate
  Time last_arrival_{0};
  Time batch_span_{200'000'000};  ///< from the arrival before this one's; of the first, a guess
  std::optional<Run> wrong_;
  std::optional<Run> late_;
};

}  // namespace merkel
