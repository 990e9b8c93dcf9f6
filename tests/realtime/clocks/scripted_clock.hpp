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
  /// The time that the work takes that begins at a given time.
  using Work = std::function<std::chrono::nanoseconds(std::chrono::nanoseconds)>;
  /// \param stop  the part of it for which the host stops the thread
  explicit ScriptedClock(Script script, Work work = {}, Work stop = {})
      : script_(std::move(script)), work_(std::move(work)), stop_(std::move(stop)) {}

  /// The first call after a wait returns its end; the work is done before the second call.
  [[nodiscard]] std::chrono::nanoseconds now() noexcept {
    if (++looks_ == 2 && work_) {
      const auto took = work_(now_);
      used_ += took - (stop_ ? stop_(now_) : std::chrono::nanoseconds{0});
      now_ += took;
    }
    return now_;
  }
  [[nodiscard]] std::chrono::nanoseconds processor_time() const noexcept { return used_; }
  void wait_until(std::chrono::nanoseconds time) noexcept {
    now_ = std::max(now_, script_(std::max(now_, time)));
    looks_ = 0;
  }
  bool wait_for_others() noexcept { return false; }

 private:
  Script script_;
  Work work_;
  Work stop_;
  std::chrono::nanoseconds now_{0};
  std::chrono::nanoseconds used_{0};
  int looks_ = 2;
};

}  // namespace merkel
