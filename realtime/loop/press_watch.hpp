#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

#include "core/realtime_tag.hpp"
#include "core/records/contact_input.hpp"

namespace merkel {

/// A probe's deepest press of a run, as the probe reported it.
struct DeepestPress {
  ContactInput input;
  std::chrono::nanoseconds rise{0};   ///< from the touch to within 5 % of its depth
  std::chrono::nanoseconds touch{0};  ///< how long that touch lasted
};

/// All that a probe reported in a run, as far as it shows a wrong sign, zero or unit.
struct PressRange {
  double least_force_mN = 0.0;
  double most_force_mN = 0.0;
  double most_depth_mm = 0.0;
  std::chrono::nanoseconds longest_touch{0};
  double least_force_of_longest_mN = 0.0;  ///< in the longest touch
  std::uint64_t brief_touches = 0;         ///< shorter than a finger or a stage can touch: noise
};

/// Finds the deepest press and the range of the readings of one probe, tick by tick. Real-time:
/// yes. Thread: simulation.
class PressWatch {
 public:
  /// \param input  of a tick. \param touches  whether the probe touches. \param deepest_mm  deepest
  ///     press so far, this tick included; of a
  ///     tactile array, the largest force in mN
  void observe(const ContactInput& input, bool touches, double deepest_mm,
               std::chrono::nanoseconds begin,
               std::chrono::nanoseconds end) noexcept MERKEL_REALTIME {
    observe_range(input, touches, begin, end);
    if (!touches) {
      began_.reset();
      return;
    }
    if (!began_) {
      began_ = begin;
      deepest_touch_ = false;
    }
    if (deepest_mm > deepest_mm_) {
      if (!deepest_touch_) risen_mm_ = 0.0;  // the rise of another touch
      deepest_mm_ = deepest_mm;
      deepest_touch_ = true;
      press_.input = input;
      if (deepest_mm > kMuchDeeper * risen_mm_) {
        risen_mm_ = deepest_mm;
        press_.rise = end - *began_;
      }
    }
    if (deepest_touch_) press_.touch = end - *began_;
  }

  /// Read after the run.
  [[nodiscard]] const DeepestPress& press() const noexcept { return press_; }
  [[nodiscard]] const PressRange& range() const noexcept { return range_; }

 private:
  static constexpr double kMuchDeeper = 1.05;
  static constexpr std::chrono::milliseconds kBrief{15};  ///< a contact ends 10 ms after its force

  void observe_range(const ContactInput& input, bool touches, std::chrono::nanoseconds begin,
                     std::chrono::nanoseconds end) noexcept MERKEL_REALTIME {
    range_.least_force_mN = std::min(range_.least_force_mN, input.force_mN);
    range_.most_force_mN = std::max(range_.most_force_mN, input.force_mN);
    range_.most_depth_mm = std::max(range_.most_depth_mm, input.depth_mm);
    if (!touches) {
      if (began_ && begin - *began_ < kBrief) ++range_.brief_touches;
      return;
    }
    if (!began_) least_of_touch_mN_ = input.force_mN;
    least_of_touch_mN_ = std::min(least_of_touch_mN_, input.force_mN);
    const std::chrono::nanoseconds touch = end - began_.value_or(begin);
    if (touch < range_.longest_touch) return;
    range_.longest_touch = touch;
    range_.least_force_of_longest_mN = least_of_touch_mN_;
  }

  DeepestPress press_;
  PressRange range_;
  double least_of_touch_mN_ = 0.0;
  double deepest_mm_ = 0.0;
  double risen_mm_ = 0.0;                          ///< depth that press_.rise belongs to
  bool deepest_touch_ = false;                     ///< the present touch holds the deepest press
  std::optional<std::chrono::nanoseconds> began_;  ///< the present touch
};

}  // namespace merkel
