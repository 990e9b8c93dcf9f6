#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace merkel {

/// Compares the rate of a device's clock with the host's, using an early frame of every 40 ms.
///
/// The rate is the median slope between these frames (Theil and Sen), over 5, 10, 20, 40 and 80 of
/// them. The clock is mistrusted if one of these slopes is off by more than 3 % plus what the
/// scatter of the frames explains: not an oscillator's error, but a wrong unit, a stopped clock or
/// a wrong crystal. On a loaded machine, where frames are read up to 200 ms late, the decision
/// takes longer. After five seconds of agreement the clock is trusted again. Real-time: no.
/// Thread: probe.
class RateWatch {
 public:
  /// \param device_time  unwrapped
  void observe(std::chrono::nanoseconds device_time, std::chrono::nanoseconds arrival);
  /// Reports a new anchor of the clock. Several within two seconds also make it mistrusted.
  void reanchored(std::chrono::nanoseconds arrival) noexcept;

  [[nodiscard]] bool agrees() const noexcept { return agrees_; }
  /// Device seconds per host second; 1 until measured.
  [[nodiscard]] double rate() const noexcept { return rate_; }

 private:
  using Time = std::chrono::nanoseconds;
  static constexpr std::size_t kHistory = 80;
  static constexpr std::size_t kFrames = 128;  ///< compared frames of a window
  struct Frame {
    Time arrival{0};
    Time device{0};
  };
  struct Fit {
    double slope = 1.0;
    double error = 0.0;  ///< what the scatter explains
  };
  [[nodiscard]] Frame early_frame() noexcept;
  void compare(const Frame& now);
  [[nodiscard]] Fit fit(std::size_t frames) const;

  std::array<Frame, kFrames> window_{};
  std::size_t frames_ = 0;  ///< in the current window
  std::size_t stride_ = 1;  ///< every so many frames are kept
  std::size_t skipped_ = 0;
  std::array<Frame, kHistory> history_{};  ///< early frames, a ring
  std::size_t count_ = 0;
  std::uint32_t good_windows_ = 0;
  std::array<Time, 5> anchors_{};  ///< arrivals at which the clock was anchored anew, a ring
  std::size_t anchor_count_ = 0;
  Time last_anchor_{0};
  bool agrees_ = true;
  double rate_ = 1.0;
};

}  // namespace merkel
