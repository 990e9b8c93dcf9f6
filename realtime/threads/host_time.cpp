#include "realtime/threads/host_time.hpp"

#include <cerrno>
#include <cstdint>
#include <ctime>

namespace merkel {
namespace {

constexpr long kPerSecond = 1'000'000'000;

}  // namespace

std::chrono::nanoseconds host_now() noexcept {
  timespec time{};
  ::clock_gettime(CLOCK_MONOTONIC, &time);
  return std::chrono::nanoseconds{static_cast<std::int64_t>(time.tv_sec) * kPerSecond +
                                  time.tv_nsec};
}

void host_sleep_until(std::chrono::nanoseconds time) noexcept {
  timespec deadline{};
  deadline.tv_sec = static_cast<std::time_t>(time.count() / kPerSecond);
  deadline.tv_nsec = static_cast<long>(time.count() % kPerSecond);
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
  }
}

}  // namespace merkel
