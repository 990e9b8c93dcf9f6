#include "drivers/clock/clock_pair.hpp"

#include <algorithm>
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
  // A read of UTC between two of the other clock; the closest of a few, in case of an interrupt.
  constexpr int kReads = 3;
  ClockPair best;
  auto closest = std::chrono::nanoseconds::max();
  for (int i = 0; i < kReads; ++i) {
    const auto before = read(CLOCK_MONOTONIC);
    const auto utc = read(CLOCK_REALTIME);
    const auto width = read(CLOCK_MONOTONIC) - before;
    if (width < closest) best = {.monotonic = before + width / 2, .utc = utc};
    closest = std::min(closest, width);
  }
  return best;
}

}  // namespace merkel
