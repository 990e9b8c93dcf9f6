#include "realtime/threads/thread_rights.hpp"

#include <fstream>
#include <string>

#include <sched.h>
#include <sys/prctl.h>

namespace merkel {
namespace {

/// The core that the thread may run on, if it is a single core; else −1.
std::int32_t only_cpu() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (::sched_getaffinity(0, sizeof allowed, &allowed) != 0 || CPU_COUNT(&allowed) != 1) return -1;
  std::int32_t cpu = 0;
  while (!CPU_ISSET(static_cast<std::size_t>(cpu), &allowed)) ++cpu;
  return cpu;
}

std::int64_t locked_memory_kB() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    std::int64_t kB = 0;
    if (word == "VmLck:" && status >> kB) return kB;
  }
  return -1;
}

}  // namespace

RunStatus::Rights rights_of_this_thread() {
  RunStatus::Rights rights;
  const int policy = ::sched_getscheduler(0);
  sched_param parameters{};
  if (policy >= 0 && ::sched_getparam(0, &parameters) == 0) {
    rights.scheduling_class = policy & ~SCHED_RESET_ON_FORK;
    rights.priority = parameters.sched_priority;
  }
  rights.cpu = only_cpu();
  rights.locked_memory_kB = locked_memory_kB();
  rights.timer_slack_ns = ::prctl(PR_GET_TIMERSLACK);
  return rights;
}

}  // namespace merkel
