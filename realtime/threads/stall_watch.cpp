#include "realtime/threads/stall_watch.hpp"

#include <cstddef>
#include <stop_token>
#include <thread>

#include <sched.h>

#include "realtime/queues/bounded_queue.hpp"
#include "realtime/threads/host_time.hpp"

namespace merkel {
namespace {

constexpr std::size_t kStallQueue = 64;

}  // namespace

struct StallWatch::Core {
  Core(int cpu, const RealtimeSettings& settings)
      : thread([this, cpu, settings](const std::stop_token& stop) {
          if (!set_up_watch_thread(settings, cpu)) return;
          while (!stop.stop_requested()) {
            const Time asleep = host_now();
            host_sleep_until(asleep + kPeriod);
            const Time woken = host_now();
            if (woken - asleep - kPeriod <= kMin) continue;
            // The stall may have begun during the sleep. A full queue means that nobody needs it.
            static_cast<void>(stalls.try_push({asleep, woken}));
          }
        }) {}

  BoundedQueue<Stall> stalls{kStallQueue};
  std::jthread thread;
};

StallWatch::StallWatch(const RealtimeSettings& settings) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (!settings.fifo || ::sched_getaffinity(0, sizeof allowed, &allowed) != 0) return;
  if (CPU_COUNT(&allowed) > kMaxCores) return;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &allowed)) {
      cores_.push_back(std::make_unique<Core>(cpu, settings));
    }
  }
}

StallWatch::~StallWatch() = default;

bool StallWatch::take(Stall& stall) noexcept {
  for (const auto& core : cores_) {
    if (core->stalls.try_pop(stall)) return true;
  }
  return false;
}

}  // namespace merkel
