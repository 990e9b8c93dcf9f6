#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <pthread.h>

#include "core/parameters/parameter_error.hpp"

namespace merkel {

/// The rights that the simulation thread requests from the host.
struct RealtimeSettings {
  bool fifo = true;         ///< SCHED_FIFO; else SCHED_OTHER
  int priority = 70;        ///< 1 to 98: 99 belongs to the kernel's own threads
  std::optional<int> cpu;   ///< core to pin the thread to; default: none
  bool lock_memory = true;  ///< keep all pages of the process in memory
  bool cpu_awake = true;    ///< keep idle cores out of deep sleep (/dev/cpu_dma_latency)

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
};

/// The rights that the host granted.
struct RealtimeRights {
  bool fifo = false;
  int priority = 0;
  std::optional<int> cpu;
  bool memory_locked = false;
  bool cpu_awake = false;
  /// One sentence for each refused request: which right is missing and how to get it.
  std::vector<std::string> missing;
};

/// Process-wide settings while the simulation runs: locked memory, cores awake.
class ProcessSetup {
 public:
  ProcessSetup(const RealtimeSettings& settings, RealtimeRights& rights);
  ProcessSetup(const ProcessSetup&) = delete;
  ProcessSetup& operator=(const ProcessSetup&) = delete;
  /// Releases both.
  ~ProcessSetup();

 private:
  bool locked_ = false;
  int cpu_latency_file_ = -1;
};

/// Names and pins the calling thread, raises its priority (raised_threads.hpp), and touches its
/// stack. If SCHED_FIFO is refused, the thread stays in SCHED_OTHER with a timer slack of 1 ns.
void set_up_simulation_thread(const RealtimeSettings& settings, RealtimeRights& rights);
/// The same for a thread that shares the simulation's work (`loop.threads`), on any core but the
/// simulation's.
void set_up_worker_thread(const RealtimeSettings& settings, int worker);
/// The same for a thread that watches one core, with a priority above the simulation's.
/// \return whether it has that priority
[[nodiscard]] bool set_up_watch_thread(const RealtimeSettings& settings, int cpu);
/// The same for the thread of a simulated device: a device does not wait for a core of this
/// machine.
void set_up_device_thread();
/// Names the calling thread (at most 15 characters) and sets its timer slack to 1 ns; does not
/// raise its priority.
void set_up_helper_thread(const char* name);

/// Processor time that a running thread has used; 0 if unknown. Thread: any.
[[nodiscard]] std::chrono::nanoseconds processor_time(pthread_t thread) noexcept;

/// Page faults and context switches of a thread since it started.
struct ThreadUsage {
  std::uint64_t minor_faults = 0;          ///< pages mapped at first touch
  std::uint64_t major_faults = 0;          ///< pages read from disk
  std::uint64_t involuntary_switches = 0;  ///< times that another thread took the core
  std::uint64_t voluntary_switches = 0;    ///< sleeps

  [[nodiscard]] static ThreadUsage of_this_thread() noexcept;
  [[nodiscard]] ThreadUsage since(const ThreadUsage& earlier) const noexcept;
};

/// The facts that decide whether the process may use SCHED_FIFO and lock memory.
struct RightsFacts {
  bool cap_sys_nice = false;
  bool cap_ipc_lock = false;
  std::uint64_t rtprio_limit = 0;
  std::uint64_t memlock_limit_bytes = 0;  ///< UINT64_MAX: no limit
  bool container = false;

  [[nodiscard]] static RightsFacts of_this_process();
};

/// The right that SCHED_FIFO at a priority lacks, and how to get it.
[[nodiscard]] std::string fifo_refusal(const RightsFacts& facts, int priority);
/// The right that locking memory lacks, and how to get it.
[[nodiscard]] std::string memory_lock_refusal(const RightsFacts& facts);

}  // namespace merkel
