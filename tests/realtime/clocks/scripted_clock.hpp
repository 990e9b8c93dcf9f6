#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <utility>

namespace merkel {

/// Virtual time in which a script decides what happens: a wait returns after the script has done
/// what belongs to that time. Tests of the loop's policy get exact counts from it.
class ScriptedClock {
 public:
  /// \param script  called with the time waited for; may deliver samples, and returns the time at
  ///                which the wait ends (later than asked for: a late wake-up)
  using Script = std::function<std::chrono::nanoseconds(std::chrono::nanoseconds)>;
  /// How long what begins at a time takes to compute.
  using Work = std::function<std::chrono::nanoseconds(std::chrono::nanoseconds)>;
  explicit ScriptedClock(Script script, Work work = {})
      : script_(std::move(script)), work_(std::move(work)) {}

  /// The first look after a wait tells when it ended; before the second, the work was done.
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
