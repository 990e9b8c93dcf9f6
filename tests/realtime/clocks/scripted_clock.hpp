#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <utility>

namespace merkel {

/// Virtual time controlled by a script: a wait returns after the script has performed the actions
/// due by that time. Gives tests of the loop's policy exact counts.
class ScriptedClock {
 public:
  /// \param script  called with the requested time; may deliver samples, and returns the time at
  /// which the wait ends (later than requested: a late wake-up)
  using Script = std::function<std::chrono::nanoseconds(std::chrono::nanoseconds)>;
  /// The computing time of the work that begins at a given time.
  using Work = std::function<std::chrono::nanoseconds(std::chrono::nanoseconds)>;
  explicit ScriptedClock(Script script, Work work = {})
      : script_(std::move(script)), work_(std::move(work)) {}

  /// The first call after a wait returns its end; the work is done before the second call.
  [[nodiscard]] std::chrono::nanoseconds now() noexcept {
    if (++looks_ == 2 && work_) now_ += work_(now_);
    return now_;
  }
  void wait_until(std::chrono::nanoseconds time) noexcept {
    now_ = std::max(now_, script_(std::max(now_, time)));
    looks_ = 0;
  }
  bool wait_for_others() noexcept { return false; }

 private:
  Script script_;
  Work work_;
  std::chrono::nanoseconds now_{0};
  int looks_ = 2;
};

}  // namespace merkel
