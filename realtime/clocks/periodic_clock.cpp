#include "realtime/clocks/periodic_clock.hpp"

#include <algorithm>
#include <cerrno>
#include <ctime>

#include "realtime/queues/publish_beat.hpp"
#include "realtime/threads/spin_wait.hpp"
#include "realtime/threads/spinning_team.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr long kPerSecond = 1'000'000'000;
constexpr int kCalibrationSleeps = 64;
constexpr nanoseconds kCalibrationSleep{200'000};

}  // namespace

nanoseconds PeriodicClock::now() noexcept {
  timespec time{};
  ::clock_gettime(CLOCK_MONOTONIC, &time);
  return nanoseconds{static_cast<std::int64_t>(time.tv_sec) * kPerSecond + time.tv_nsec};
}

void PeriodicClock::sleep_until(nanoseconds time) noexcept {
  timespec deadline{};
  deadline.tv_sec = static_cast<std::time_t>(time.count() / kPerSecond);
  deadline.tv_nsec = static_cast<long>(time.count() % kPerSecond);
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
  }
}

void PeriodicClock::sleep_measured(nanoseconds time) noexcept {
  sleep_until(time);
  margin_.add(now() - time);
  margin_ns_.store(margin_.margin().count(), std::memory_order_relaxed);
}

void PeriodicClock::calibrate() noexcept {
  for (int i = 0; i < kCalibrationSleeps; ++i) sleep_measured(now() + kCalibrationSleep);
}

void PeriodicClock::wait_until(nanoseconds time) noexcept {
  if (parameters_.team != nullptr) parameters_.team->rest_until(time);
  if (parameters_.beat != nullptr) parameters_.beat->expect(time);
  const nanoseconds begun = now();
  if (time <= begun) return;
  if (parameters_.wait == LoopWait::kSleep) {
    sleep_until(time);
    return;
  }
  // Some sleep in every wait, however short: a thread of real-time priority that never sleeps
  // starves its core and is throttled by the kernel.
  sleep_measured(time - std::min(margin_.margin(), (time - begun) * 9 / 10));
  while (now() < time) pause_core();
}

}  // namespace merkel
