#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "core/realtime_tag.hpp"
#include "core/records/contact_input.hpp"
#include "core/records/probe_sample.hpp"

namespace merkel {

/// The mean of the samples of one tick: the low-pass filter of a probe that is faster than the
/// loop. It is that of the middle of the tick. Real-time: yes, after construction.
class TickMean {
 public:
  /// \param taxels  of a tactile array
  explicit TickMean(std::size_t taxels) : taxels_(taxels) {}

  void clear() noexcept MERKEL_REALTIME { count_ = 0.0; }

  /// \param taxels  empty: all 0
  void add(const ContactInput& sample, Touch touch,
           std::span<const double> taxels) noexcept MERKEL_REALTIME {
    if (count_ == 0.0) {
      sum_ = {};
      touch_ = touch;
      for (double& sum : taxels_) sum = 0.0;
    }
    count_ += 1.0;
    touch_ = std::max(touch_, touch);
    sum_.depth_mm += sample.depth_mm;
    sum_.force_mN += sample.force_mN;
    sum_.x_mm += sample.x_mm;
    sum_.y_mm += sample.y_mm;
    for (std::size_t i = 0; i < taxels.size(); ++i) taxels_[i] += taxels[i];
  }

  /// Whether there is something to average.
  [[nodiscard]] bool several() const noexcept MERKEL_REALTIME { return count_ > 1.0; }
  [[nodiscard]] ContactInput contact() const noexcept MERKEL_REALTIME {
    return {.depth_mm = sum_.depth_mm / count_,
            .force_mN = sum_.force_mN / count_,
            .x_mm = sum_.x_mm / count_,
            .y_mm = sum_.y_mm / count_};
  }
  /// Whether one of them touches.
  [[nodiscard]] Touch touch() const noexcept MERKEL_REALTIME { return touch_; }
  [[nodiscard]] float taxel(std::size_t i) const noexcept MERKEL_REALTIME {
    return static_cast<float>(taxels_[i] / count_);
  }

 private:
  double count_ = 0.0;
  ContactInput sum_;
  Touch touch_ = Touch::kUndecided;
  std::vector<double> taxels_;  ///< sums
};

}  // namespace merkel
