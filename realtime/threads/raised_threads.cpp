#include "realtime/threads/raised_threads.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <utility>

#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace merkel {
namespace {

constexpr rlim_t kDemoteAfter_us = 500'000;
constexpr rlim_t kEndAfter_us = 2'000'000;

// Global, because a signal handler has no other way to reach the threads.
std::array<std::atomic<pid_t>, 256> g_raised{};
std::atomic<bool> g_demoted{false};

void demote(int /*signal*/) {
  const int saved = errno;
  demote_raised_threads();
  errno = saved;
}

void limit_time_without_sleep() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_RTTIME, &limit) != 0) return;
  limit.rlim_cur = std::min(limit.rlim_max, kDemoteAfter_us);
  limit.rlim_max = std::min(limit.rlim_max, kEndAfter_us);
  struct sigaction action {};
  action.sa_handler = demote;
  action.sa_flags = SA_RESTART;
  if (::sigaction(SIGXCPU, &action, nullptr) == 0) ::setrlimit(RLIMIT_RTTIME, &limit);
}

}  // namespace

RaisedThread::RaisedThread(pid_t thread) noexcept {
  for (std::atomic<pid_t>& slot : g_raised) {
    pid_t free = 0;
    if (!slot.compare_exchange_strong(free, thread)) continue;
    slot_ = &slot;
    return;
  }
}

RaisedThread::RaisedThread(RaisedThread&& other) noexcept
    : slot_(std::exchange(other.slot_, nullptr)) {}

RaisedThread::~RaisedThread() {
  if (slot_ != nullptr) slot_->store(0);
}

pid_t this_thread() noexcept { return static_cast<pid_t>(::syscall(SYS_gettid)); }

bool request_fifo(pid_t thread, int priority) noexcept {
  sched_param parameters{};
  parameters.sched_priority = priority;
  if (::sched_setscheduler(thread, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters) != 0) {
    return false;
  }
  limit_time_without_sleep();
  return true;
}

void demote_raised_threads() noexcept {
  const sched_param normal{};
  for (const std::atomic<pid_t>& slot : g_raised) {
    const pid_t thread = slot.load();
    if (thread != 0 && ::sched_setscheduler(thread, SCHED_OTHER, &normal) == 0) g_demoted = true;
  }
}

bool simulation_was_demoted() noexcept { return g_demoted; }
void forget_demotions() noexcept { g_demoted = false; }

}  // namespace merkel
