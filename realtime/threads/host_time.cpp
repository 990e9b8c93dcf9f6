#include "realtime/threads/host_time.hpp"

#include <cerrno>
#include <cstdint>
#include <ctime>

namespace merkel {
namespace {

constexpr long kPerSecond = 1'000'000'000;

std::chrono::nanoseconds time_of(clockid_t clock) noexcept {
  timespec time{};
  ::clock_gettime(clock, &time);
  return std::chrono::nanoseconds{static_cast<std::int64_t>(time.tv_sec) * kPerSecond +
                                  time.tv_nsec};
}

}  // namespace

std::chrono::nanoseconds host_now() noexcept { return time_of(CLOCK_MONOTONIC); }

std::chrono::nanoseconds host_processor_time() noexcept { return time_of(CLOCK_THREAD_CPUTIME_ID); }

void host_sleep_until(std::chrono::nanoseconds time) noexcept {
  timespec deadline{};
  deadline.tv_sec = static_cast<std::time_t>(time.count() / kPerSecond);
  deadline.tv_nsec = static_cast<long>(time.count() % kPerSecond);
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
  }
}

}  // namespace merkel
