#include "realtime/threads/thread_setup.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>

#include <fcntl.h>
#include <linux/capability.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "realtime/threads/host_time.hpp"
#include "realtime/threads/raised_threads.hpp"

namespace merkel {
namespace {

constexpr int kDevicePriority = 80;  ///< above the simulation's

std::uint64_t limit_of(int resource) {
  rlimit limit{};
  // NOLINTNEXTLINE(readability-redundant-casting): the type of the argument differs by C library
  if (::getrlimit(static_cast<__rlimit_resource>(resource), &limit) != 0) return 0;
  return limit.rlim_cur == RLIM_INFINITY ? UINT64_MAX : limit.rlim_cur;
}

/// Touches the part of the stack that the thread's calls may need, so that no page fault occurs
/// later.
void touch_stack() {
  std::array<volatile char, std::size_t{128} * 1024> stack;
  for (std::size_t i = 0; i < stack.size(); i += 1024) stack[i] = 0;
}

/// Requests SCHED_FIFO; if refused, stays in SCHED_OTHER with a timer slack of 1 ns.
bool raise_thread(const RealtimeSettings& settings) {
  if (settings.fifo && request_fifo(this_thread(), settings.priority)) {
    thread_local const RaisedThread raised(this_thread());
    return true;
  }
  ::prctl(PR_SET_TIMERSLACK, 1UL);
  return false;
}

}  // namespace

FieldTable RealtimeSettings::fields() {
  using P = RealtimeSettings;
  static constexpr std::string_view kSchedulers[] = {"fifo", "normal"};
  static constexpr Field kFields[] = {
      {"scheduler", "", one_of(kSchedulers),
       "scheduling class of the simulation thread: SCHED_FIFO or SCHED_OTHER",
       [](void* p) -> FieldPointer {
         return Choice{
             &static_cast<P*>(p)->fifo,
             [](const void* is_fifo) -> std::optional<std::size_t> {
               return *static_cast<const bool*>(is_fifo) ? 0 : 1;
             },
             [](void* is_fifo, std::size_t word) { *static_cast<bool*>(is_fifo) = word == 0; }};
       }},
      {"priority", "", from_to(1, 98), "priority of SCHED_FIFO", at<&P::priority>},
      {"cpu", "", from_to(0, CPU_SETSIZE - 1), "core to which the simulation thread is pinned",
       at<&P::cpu>, "not pinned"},
      {"lock_memory", "", any_value(), "keep the program's memory from being paged out",
       at<&P::lock_memory>},
      {"cpu_awake", "", any_value(), "keep idle cores in shallow sleep (/dev/cpu_dma_latency)",
       at<&P::cpu_awake>}};
  return {"loop", kFields};
}

Expected<void, ParameterError> RealtimeSettings::check() const {
  return ParameterCheck().fields(*this).result();
}

RightsFacts RightsFacts::of_this_process() {
  RightsFacts facts;
  __user_cap_header_struct header{.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> data{};
  if (::syscall(SYS_capget, &header, data.data()) == 0) {
    facts.cap_sys_nice = (data[0].effective >> unsigned{CAP_SYS_NICE} & 1U) != 0;
    facts.cap_ipc_lock = (data[0].effective >> unsigned{CAP_IPC_LOCK} & 1U) != 0;
  }
  facts.rtprio_limit = limit_of(RLIMIT_RTPRIO);
  facts.memlock_limit_bytes = limit_of(RLIMIT_MEMLOCK);
  for (const char* const mark : {"/.dockerenv", "/run/.containerenv", "/run/systemd/container"}) {
    facts.container = facts.container || ::access(mark, F_OK) == 0;
  }
  return facts;
}

std::string fifo_refusal(const RightsFacts& facts, int priority) {
  const std::string wanted = std::to_string(priority);
  if (facts.cap_sys_nice || facts.rtprio_limit >= static_cast<std::uint64_t>(priority)) {
    return "no real-time priority, although this process has the right to it: its control group "
           "has no real-time budget (RT_GROUP_SCHED); write 950000 to the group's "
           "cpu.rt_runtime_us, or start merkel from the root group";
  }
  const std::string lack =
      "no real-time priority: merkel has neither CAP_SYS_NICE nor an rtprio "
      "limit of at least " +
      wanted + " (it is " + std::to_string(facts.rtprio_limit) + "); ";
  if (facts.container) {
    return lack + "start the container with --cap-add=SYS_NICE --ulimit rtprio=" + wanted;
  }
  return lack + "write \"@realtime - rtprio " + wanted +
         "\" to /etc/security/limits.d/realtime.conf, join the group realtime and log in again";
}

std::string memory_lock_refusal(const RightsFacts& facts) {
  const std::string lack =
      "memory is not locked: merkel has neither CAP_IPC_LOCK nor an unlimited memlock limit (it "
      "is " +
      std::to_string(facts.memlock_limit_bytes / 1024) + " KiB); ";
  if (facts.container) {
    return lack + "start the container with --cap-add=IPC_LOCK --ulimit memlock=-1";
  }
  return lack +
         "write \"@realtime - memlock unlimited\" to /etc/security/limits.d/realtime.conf, join "
         "the group realtime and log in again";
}

ProcessSetup::ProcessSetup(const RealtimeSettings& settings, RealtimeRights& rights) {
  if (settings.lock_memory) {
    const RightsFacts facts = RightsFacts::of_this_process();
    // With a finite limit, locking would succeed and a later allocation fail.
    if (!facts.cap_ipc_lock && facts.memlock_limit_bytes != UINT64_MAX) {
      rights.missing.push_back(memory_lock_refusal(facts));
    } else if (::mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
      rights.missing.push_back(std::string("memory is not locked: ") + std::strerror(errno) +
                               "; free some memory");
    } else {
      locked_ = true;
    }
    rights.memory_locked = locked_;
  }
  if (settings.cpu_awake) {
    cpu_latency_file_ = ::open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
    const std::int32_t longest_us = 0;
    rights.cpu_awake =
        cpu_latency_file_ >= 0 && ::write(cpu_latency_file_, &longest_us, sizeof longest_us) ==
                                      static_cast<ssize_t>(sizeof longest_us);
    if (!rights.cpu_awake) {
      rights.missing.push_back(
          std::string(
              "idle cores may enter deep sleep states, because /dev/cpu_dma_latency cannot be "
              "written: ") +
          std::strerror(errno) +
          "; give its group write access with the udev rule KERNEL==\"cpu_dma_latency\", "
          "GROUP=\"realtime\", MODE=\"0660\"");
    }
  }
}

ProcessSetup::~ProcessSetup() {
  if (locked_) ::munlockall();
  if (cpu_latency_file_ >= 0) ::close(cpu_latency_file_);
}

void set_up_simulation_thread(const RealtimeSettings& settings, RealtimeRights& rights) {
  ::pthread_setname_np(::pthread_self(), "merkel-sim");
  touch_stack();
  if (settings.cpu) {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(static_cast<std::size_t>(*settings.cpu), &one);
    if (::sched_setaffinity(0, sizeof one, &one) == 0) {
      rights.cpu = settings.cpu;
    } else {
      rights.missing.push_back(
          "the simulation is not pinned: core " + std::to_string(*settings.cpu) +
          " is not available to merkel; change loop.cpu or the cpuset of the process");
    }
  }
  forget_demotions();
  rights.fifo = raise_thread(settings);
  if (rights.fifo) {
    rights.priority = settings.priority;
  } else if (settings.fifo) {
    rights.missing.push_back(fifo_refusal(RightsFacts::of_this_process(), settings.priority));
  }
}

void set_up_worker_thread(const RealtimeSettings& settings, int worker) {
  const std::string name = "merkel-work" + std::to_string(worker % 1000);
  ::pthread_setname_np(::pthread_self(), name.c_str());
  touch_stack();
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (settings.cpu && ::sched_getaffinity(0, sizeof allowed, &allowed) == 0) {
    CPU_CLR(static_cast<std::size_t>(*settings.cpu), &allowed);
    if (CPU_COUNT(&allowed) > 0) ::sched_setaffinity(0, sizeof allowed, &allowed);
  }
  raise_thread(settings);
}

bool set_up_watch_thread(const RealtimeSettings& settings, int cpu) {
  ::pthread_setname_np(::pthread_self(), "merkel-watch");
  touch_stack();
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(static_cast<std::size_t>(cpu), &one);
  if (::sched_setaffinity(0, sizeof one, &one) != 0) return false;
  RealtimeSettings above = settings;
  ++above.priority;
  return raise_thread(above);
}

void set_up_device_thread() {
  ::pthread_setname_np(::pthread_self(), "merkel-device");
  touch_stack();
  static_cast<void>(raise_thread({.priority = kDevicePriority}));
}

void set_up_helper_thread(const char* name) {
  ::pthread_setname_np(::pthread_self(), name);
  ::prctl(PR_SET_TIMERSLACK, 1UL);
}

std::chrono::nanoseconds processor_time(pthread_t thread) noexcept {
  clockid_t clock{};
  if (::pthread_getcpuclockid(thread, &clock) != 0) return std::chrono::nanoseconds{0};
  return clock_time(clock).value_or(std::chrono::nanoseconds{0});
}

ThreadUsage ThreadUsage::of_this_thread() noexcept {
  rusage usage{};
  ::getrusage(RUSAGE_THREAD, &usage);
  return {.minor_faults = static_cast<std::uint64_t>(usage.ru_minflt),
          .major_faults = static_cast<std::uint64_t>(usage.ru_majflt),
          .involuntary_switches = static_cast<std::uint64_t>(usage.ru_nivcsw),
          .voluntary_switches = static_cast<std::uint64_t>(usage.ru_nvcsw)};
}

ThreadUsage ThreadUsage::since(const ThreadUsage& earlier) const noexcept {
  return {.minor_faults = minor_faults - earlier.minor_faults,
          .major_faults = major_faults - earlier.major_faults,
          .involuntary_switches = involuntary_switches - earlier.involuntary_switches,
          .voluntary_switches = voluntary_switches - earlier.voluntary_switches};
}

}  // namespace merkel
