#pragma once

#include <array>
#include <chrono>
#include <cstddef>

namespace merkel {

/// Monitors a thread's share of a processor, to detect a real-time thread that leaves no time to
/// others, even if it sleeps briefly now and then.
class ProcessorShare {
 public:
  /// A larger share over a whole window leaves too little time to others.
  static constexpr double kMax = 0.95;
  static constexpr std::chrono::seconds kWindow{1};

  explicit ProcessorShare(double most = kMax, std::chrono::nanoseconds window = kWindow) noexcept
      : most_(most), every_(window / kLooks) {}

  /// \param now   host time, later than in the previous call
  /// \param used  processor time of the thread so far
  /// \return whether the share over the last window was above kMax
  [[nodiscard]] bool too_large(std::chrono::nanoseconds now,
                               std::chrono::nanoseconds used) noexcept {
    const Look look{now, used};
    if (looks_ == 0 || now - newest().now >= every_) history_[looks_++ % history_.size()] = look;
    if (looks_ < history_.size()) return false;
    const Look& oldest = history_[looks_ % history_.size()];
    return static_cast<double>((used - oldest.used).count()) >
           most_ * static_cast<double>((now - oldest.now).count());
  }

 private:
  struct Look {
    std::chrono::nanoseconds now{0};
    std::chrono::nanoseconds used{0};
  };
  static constexpr int kLooks = 10;  ///< in a window
  [[nodiscard]] const Look& newest() const noexcept {
    return history_[(looks_ - 1) % history_.size()];
  }

  double most_;
  std::chrono::nanoseconds every_;
  std::array<Look, kLooks + 1> history_{};
  std::size_t looks_ = 0;
};

}  // namespace merkel
