#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace merkel {

/// Compares the rate of a device's clock with the host's, using the earliest frames of every
/// 100 ms.
///
/// The clock is mistrusted if the median of eight such comparisons is off by more than 3 %: not an
/// oscillator's error, but a wrong unit, a stopped clock or a wrong crystal. Stalls and jumps
/// disturb single comparisons but not the median. After five seconds of agreement the clock is
/// trusted again. Real-time: no. Thread: probe.
class RateWatch {
 public:
  /// \param device_time  unwrapped
  void observe(std::chrono::nanoseconds device_time, std::chrono::nanoseconds arrival) noexcept;
  /// Reports a new anchor of the clock. Several within two seconds also make it mistrusted.
  void reanchored(std::chrono::nanoseconds arrival) noexcept;
  /// Reports a restart of the device.
  void restart() noexcept;

  [[nodiscard]] bool agrees() const noexcept { return agrees_; }
  /// Device seconds per host second; 1 until measured.
  [[nodiscard]] double rate() const noexcept { return rate_; }

 private:
  using Time = std::chrono::nanoseconds;
  static constexpr std::size_t kRates = 8;
  static constexpr std::size_t kFrames = 128;  ///< compared frames of a window
  struct Frame {
    Time arrival{0};
    Time device{0};
  };
  [[nodiscard]] Frame early_frame() noexcept;
  void compare(const Frame& now) noexcept;

  std::array<Frame, kFrames> window_{};
  std::size_t frames_ = 0;              ///< in the current window
  std::optional<Frame> previous_;       ///< an early frame of the previous window
  std::array<double, kRates> rates_{};  ///< a ring
  std::size_t count_ = 0;
  std::uint32_t good_windows_ = 0;
  std::array<Time, 5> anchors_{};  ///< arrivals at which the clock was anchored anew, a ring
  std::size_t anchor_count_ = 0;
  bool agrees_ = true;
  double rate_ = 1.0;
};

}  // namespace merkel
