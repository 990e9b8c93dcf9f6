#pragma once

#include <atomic>
#include <optional>
#include <utility>

namespace merkel {

/// A request to take the present readings as the new zero, and their mean.
/// Thread: `make` any; all else the probe's.
class TareRequest {
 public:
  void make() noexcept { pending_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool pending() const noexcept { return pending_.load(std::memory_order_relaxed); }
  void cancel() noexcept { pending_.store(false, std::memory_order_relaxed); }

  /// The mean of the last kReadings values once there are so many; the request is then fulfilled.
  [[nodiscard]] std::optional<double> add(double value) noexcept {
    sum_ += value;
    if (++count_ < kReadings) return std::nullopt;
    cancel();
    return std::exchange(sum_, 0.0) / std::exchange(count_, 0);
  }

 private:
  static constexpr int kReadings = 20;
  std::atomic<bool> pending_{false};
  double sum_ = 0.0;
  int count_ = 0;
};

}  // namespace merkel
