#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>

#include "core/realtime_tag.hpp"

namespace merkel {

/// How long before a deadline to wake up, learnt from past wake-up latencies: 1.25 times the 99th
/// percentile of the last 256, plus 5 µs. At most half the period, so that every wait includes a
/// sleep, and at most 200 µs. Real-time: yes.
class WakeUpMargin {
 public:
  static constexpr std::chrono::nanoseconds kMin{15'000};
  static constexpr std::chrono::nanoseconds kMax{200'000};

  explicit WakeUpMargin(std::chrono::nanoseconds period) noexcept
      : most_(std::min(kMax, period / 2)), margin_(std::min(most_, kFirst)) {}

  /// Adds the latency of one sleep.
  void add(std::chrono::nanoseconds latency) noexcept MERKEL_REALTIME {
    latest_[next_ % latest_.size()] = latency;
    if (++next_ % kLearnEvery == 0) learn();
  }

  [[nodiscard]] std::chrono::nanoseconds margin() const noexcept MERKEL_REALTIME { return margin_; }

 private:
  static constexpr std::size_t kLearnEvery = 32;
  static constexpr std::chrono::nanoseconds kFirst{60'000};

  void learn() noexcept {
    sorted_ = latest_;
    const auto filled = static_cast<std::ptrdiff_t>(std::min(next_, sorted_.size()));
    const auto end = sorted_.begin() + filled;
    const auto within = sorted_.begin() + (filled * 99 - 1) / 100;
    std::nth_element(sorted_.begin(), within, end);
    margin_ = std::clamp(*within + *within / 4 + std::chrono::nanoseconds{5'000},
                         std::min(kMin, most_), most_);
  }

  std::chrono::nanoseconds most_;
  std::chrono::nanoseconds margin_;
  std::array<std::chrono::nanoseconds, 256> latest_{};
  std::array<std::chrono::nanoseconds, 256> sorted_{};
  std::size_t next_ = 0;
};

}  // namespace merkel
