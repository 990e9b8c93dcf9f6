#include "drivers/clock/clock_pair.hpp"

#include <ctime>

namespace merkel {
namespace {

std::chrono::nanoseconds read(clockid_t clock) noexcept {
  timespec time{};
  ::clock_gettime(clock, &time);
  return std::chrono::seconds{time.tv_sec} + std::chrono::nanoseconds{time.tv_nsec};
}

}  // namespace

ClockPair read_clock_pair() noexcept {
  return {.monotonic = read(CLOCK_MONOTONIC), .utc = read(CLOCK_REALTIME)};
}

}  // namespace merkel
