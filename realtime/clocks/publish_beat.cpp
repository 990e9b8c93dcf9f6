#include "realtime/clocks/publish_beat.hpp"

#include <algorithm>

#include "realtime/threads/host_time.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr nanoseconds kFirstNap{20'000};
constexpr nanoseconds kMaxNap{1'000'000};

}  // namespace

void PublishBeat::wait(std::uint64_t& seen, nanoseconds longest) const noexcept {
  const nanoseconds started = host_now();
  nanoseconds nap = kFirstNap;
  for (nanoseconds now = started; now - started < longest; now = host_now()) {
    const std::uint64_t ticks = ticks_.load(std::memory_order_acquire);
    if (ticks != seen) {
      seen = ticks;
      return;
    }
    const nanoseconds next{next_ns_.load(std::memory_order_relaxed)};
    if (next.count() == 0) {  // virtual time: only the count is valid
      host_sleep_until(now + std::min(kMaxNap, longest));
    } else if (next > now) {
      host_sleep_until(std::min(next, started + longest));
    } else {
      host_sleep_until(now + nap);
      nap = std::min(2 * nap, kMaxNap);
    }
  }
}

}  // namespace merkel
