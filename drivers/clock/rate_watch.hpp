#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace merkel {

/// Compares the rate of a device's clock with the host's, by the earliest frames of every 100 ms.
///
/// The rates disagree where the median of eight such comparisons is off by more than 3 %: no
/// oscillator is, but a wrong unit, a stopped clock or a board with the wrong crystal. Stalls and
/// jumps spoil a comparison or two and leave the median alone. After five seconds without
/// disagreement the clock is trusted again. Real-time: no. Thread: probe.
class RateWatch {
 public:
  /// \param device_time  unwrapped
  void observe(std::chrono::nanoseconds device_time, std::chrono::nanoseconds arrival) noexcept;
  /// The clock had to be anchored anew: often enough in two seconds, that is a disagreement too.
  void reanchored(std::chrono::nanoseconds arrival) noexcept;
  /// The device has started anew.
  void restart() noexcept;

  [[nodiscard]] bool agrees() const noexcept { return agrees_; }
  /// Device seconds per host second; 1 until enough was seen.
  [[nodiscard]] double rate() const noexcept { return rate_; }

 private:
  using Time = std::chrono::nanoseconds;
  static constexpr std::size_t kRates = 8;
  static constexpr std::size_t kFrames = 128;  ///< of a window that are compared
  struct Frame {
    Time arrival{0};
    Time device{0};
  };
  [[nodiscard]] Frame early_frame() noexcept;
  void compare(const Frame& now) noexcept;

  std::array<Frame, kFrames> window_{};
  std::size_t frames_ = 0;              ///< of the window that is under way
  std::optional<Frame> previous_;       ///< an early frame of the window before
  std::array<double, kRates> rates_{};  ///< a ring
  std::size_t count_ = 0;
  std::uint32_t good_windows_ = 0;
  std::array<Time, 5> anchors_{};  ///< arrivals at which it was anchored anew, a ring
  std::size_t anchor_count_ = 0;
  bool agrees_ = true;
  double rate_ = 1.0;
};

}  // namespace merkel
