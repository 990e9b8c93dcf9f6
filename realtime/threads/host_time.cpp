#include "realtime/threads/host_time.hpp"

#include <cerrno>
#include <cstdint>
#include <ctime>

namespace merkel {
namespace {

constexpr long kPerSecond = 1'000'000'000;

}  // namespace

std::optional<std::chrono::nanoseconds> clock_time(clockid_t clock) noexcept {
  timespec time{};
  if (::clock_gettime(clock, &time) != 0) return std::nullopt;
  return std::chrono::nanoseconds{static_cast<std::int64_t>(time.tv_sec) * kPerSecond +
                                  time.tv_nsec};
}

std::chrono::nanoseconds host_now() noexcept {
  return clock_time(CLOCK_MONOTONIC).value_or(std::chrono::nanoseconds{0});
}

std::chrono::nanoseconds host_processor_time() noexcept {
  return clock_time(CLOCK_THREAD_CPUTIME_ID).value_or(std::chrono::nanoseconds{0});
}

void host_sleep_until(std::chrono::nanoseconds time) noexcept {
  timespec deadline{};
  deadline.tv_sec = static_cast<std::time_t>(time.count() / kPerSecond);
  deadline.tv_nsec = static_cast<long>(time.count() % kPerSecond);
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
  }
}

}  // namespace merkel
