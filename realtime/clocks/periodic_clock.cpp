#include "realtime/clocks/periodic_clock.hpp"

#include <algorithm>

#include "realtime/clocks/publish_beat.hpp"
#include "realtime/threads/host_time.hpp"
#include "realtime/threads/spin_wait.hpp"
#include "realtime/threads/spinning_team.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr int kRestShare = 10;
constexpr int kCalibrationSleeps = 64;
constexpr nanoseconds kCalibrationSleep{200'000};

}  // namespace

nanoseconds PeriodicClock::now() noexcept { return host_now(); }
nanoseconds PeriodicClock::processor_time() noexcept { return host_processor_time(); }

void PeriodicClock::sleep_measured(nanoseconds time) noexcept {
  host_sleep_until(time);
  margin_.add(now() - time);
  margin_ns_.store(margin_.margin().count(), std::memory_order_relaxed);
}

void PeriodicClock::calibrate() noexcept {
  for (int i = 0; i < kCalibrationSleeps; ++i) sleep_measured(now() + kCalibrationSleep);
}

void PeriodicClock::wait_until(nanoseconds time) noexcept {
  if (parameters_.team != nullptr) parameters_.team->rest_until(time);
  if (parameters_.beat != nullptr) parameters_.beat->expect(time);
  const nanoseconds started = now();
  if (time <= started) return;
  if (parameters_.wait == LoopWait::kSleep) {
    host_sleep_until(time);
    return;
  }
  // A real-time thread that never sleeps starves its core, and the kernel throttles it: a tenth of
  // each period is slept, or all of a shorter wait.
  const nanoseconds wait = time - started;
  const nanoseconds sleep =
      std::max(wait / kRestShare, std::min(wait, parameters_.period / kRestShare));
  sleep_measured(time - std::min(margin_.margin(), wait - sleep));
  while (now() < time) pause_core();
}

}  // namespace merkel
