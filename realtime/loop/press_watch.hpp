#pragma once

#include <chrono>
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

/// Finds the deepest press of one probe, tick by tick. Real-time: yes. Thread: simulation.
class PressWatch {
 public:
  /// \param input  of a tick; \param deepest_mm  deepest press so far, this tick included
  void observe(const ContactInput& input, double deepest_mm, std::chrono::nanoseconds begin,
               std::chrono::nanoseconds end) noexcept MERKEL_REALTIME {
    if (!(input.depth_mm > 0.0 || input.force_mN > 0.0)) {
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

 private:
  static constexpr double kMuchDeeper = 1.05;

  DeepestPress press_;
  double deepest_mm_ = 0.0;
  double risen_mm_ = 0.0;                          ///< depth that press_.rise belongs to
  bool deepest_touch_ = false;                     ///< the present touch holds the deepest press
  std::optional<std::chrono::nanoseconds> began_;  ///< the present touch
};

}  // namespace merkel
