#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

#include "core/realtime_tag.hpp"
#include "realtime/clocks/wake_up_margin.hpp"

namespace merkel {

class PublishBeat;
class SpinningTeam;

/// How the loop waits for its next tick.
enum class LoopWait : std::uint8_t {
  kHybrid,  ///< sleeps until shortly before, then spins: on time within a fraction of a microsecond
  kSleep    ///< sleeps: late by the host's wake-up latency, but never spins
};

/// The host's monotonic clock and absolute sleeps on it, for one thread. Real-time: the sleep
/// (`host_sleep_until`) is the only blocking call of the simulation thread.
class PeriodicClock {
 public:
  struct Parameters {
    LoopWait wait = LoopWait::kSleep;
    std::chrono::nanoseconds period{1'000'000};
    SpinningTeam* team = nullptr;  ///< receives the time until which it may rest
    PublishBeat* beat = nullptr;   ///< receives the time of the next spikes
  };

  PeriodicClock() noexcept : PeriodicClock(Parameters{}) {}
  explicit PeriodicClock(const Parameters& parameters) noexcept
      : parameters_(parameters), margin_(parameters.period) {}

  [[nodiscard]] static std::chrono::nanoseconds now() noexcept;
  [[nodiscard]] static std::chrono::nanoseconds processor_time() noexcept;
  void wait_until(std::chrono::nanoseconds time) noexcept;
  static bool wait_for_others() noexcept { return false; }

  /// Measures this thread's wake-up latency with a few dozen short sleeps. Call once the thread
  /// has its final priority. Takes about 15 ms.
  void calibrate() noexcept;
  /// The current margin of the hybrid wait: how long before a deadline it wakes up. Thread: any.
  [[nodiscard]] std::chrono::nanoseconds margin() const noexcept {
    return std::chrono::nanoseconds{margin_ns_.load(std::memory_order_relaxed)};
  }

 private:
  void sleep_measured(std::chrono::nanoseconds time) noexcept;

  Parameters parameters_;
  WakeUpMargin margin_;
  std::atomic<std::int64_t> margin_ns_{margin_.margin().count()};
};

}  // namespace merkel
