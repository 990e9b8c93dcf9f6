#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <thread>
#include <utility>

namespace merkel {

/// Time that passes only when the loop waits, so that a recording is simulated as fast as possible
/// and without any sample being late.
class VirtualClock {
 public:
  [[nodiscard]] std::chrono::nanoseconds now() const noexcept { return now_; }
  void wait_until(std::chrono::nanoseconds time) noexcept { now_ = std::max(now_, time); }
  /// Spins a little, then sleeps: the other threads may need this core.
  bool wait_for_others() noexcept {
    if (++idle_ % 64 == 0) {
      std::this_thread::sleep_for(std::chrono::microseconds{50});
    } else {
      std::this_thread::yield();
    }
    return true;
  }

 private:
  std::chrono::nanoseconds now_{0};
  std::uint32_t idle_ = 0;
};

/// Virtual time in which everything that happens is scripted: whoever waits until a time finds
/// what the script does at that time done. Nothing waits for anybody. For tests of the loop's
/// policy, with exact expected counts.
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
