#include "realtime/threads/serving_priority.hpp"

#include <algorithm>
#include <ctime>

#include <sched.h>

#include "realtime/threads/host_time.hpp"

namespace merkel {
namespace {

/// The kernel's clock of the processor time of a thread (clock_getcpuclockid(3) has processes
/// only).
clockid_t clock_of(pid_t thread) noexcept {
  constexpr unsigned kOfThread = 4;
  constexpr unsigned kScheduled = 2;
  return static_cast<clockid_t>(~static_cast<unsigned>(thread) << 3U | kOfThread | kScheduled);
}

}  // namespace

ServingPriority::ServingPriority(const std::optional<RealtimeSettings>& simulation,
                                 std::span<const pid_t> others) {
  if (!simulation || !simulation->fifo || simulation->priority <= 1) return;
  const auto raise = [&](pid_t thread) {
    if (request_fifo(thread, simulation->priority - 1)) {
      threads_.push_back({.number = thread, .raised = RaisedThread(thread)});
    }
  };
  raise(this_thread());
  for (const pid_t thread : others) raise(thread);
}

void ServingPriority::check(std::chrono::nanoseconds now) noexcept {
  const auto computes_too_much = [now](Thread& thread) {
    const auto used = clock_time(clock_of(thread.number));
    if (!used) return true;  // it has ended
    if (!thread.share.too_large(now, *used)) return false;
    const sched_param normal{};
    return ::sched_setscheduler(thread.number, SCHED_OTHER, &normal) == 0;
  };
  std::erase_if(threads_, computes_too_much);
}

}  // namespace merkel
