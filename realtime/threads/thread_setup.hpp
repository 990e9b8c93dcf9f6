#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <pthread.h>

#include "core/parameters/parameter_error.hpp"

namespace merkel {

/// What the simulation thread asks of the host.
struct RealtimeSettings {
  bool fifo = true;         ///< SCHED_FIFO; else SCHED_OTHER
  int priority = 70;        ///< 1 to 98: 99 belongs to the kernel's own threads
  std::optional<int> cpu;   ///< pinned to this one; to none, if not set
  bool lock_memory = true;  ///< no page of the process leaves memory
  bool cpu_awake = true;    ///< idle cores stay in shallow sleep (/dev/cpu_dma_latency)

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
};

/// What it got.
struct RealtimeRights {
  bool fifo = false;
  int priority = 0;
  std::optional<int> cpu;
  bool memory_locked = false;
  bool cpu_awake = false;
  /// A sentence for each thing that was refused: which right is missing, and how to get it.
  std::vector<std::string> missing;
};

/// What the whole process needs while the simulation runs: its memory locked, its cores awake.
class ProcessSetup {
 public:
  ProcessSetup(const RealtimeSettings& settings, RealtimeRights& rights);
  ProcessSetup(const ProcessSetup&) = delete;
  ProcessSetup& operator=(const ProcessSetup&) = delete;
  /// Gives both back.
  ~ProcessSetup();

 private:
  bool locked_ = false;
  int cpu_latency_file_ = -1;
};

/// Names, pins and raises the calling thread, in this order, and touches its stack. Where
/// SCHED_FIFO is refused, the thread stays in SCHED_OTHER with a timer slack of 1 ns. When a
/// raised thread computes for 0.5 s without a sleep, all are demoted to SCHED_OTHER, for
/// they must not freeze the machine; if even that failed, the process would be ended after 2 s
/// (RLIMIT_RTTIME).
void set_up_simulation_thread(const RealtimeSettings& settings, RealtimeRights& rights);
/// The same for a thread that shares the simulation's work (`loop.threads`): on any core but the
/// simulation's own.
void set_up_worker_thread(const RealtimeSettings& settings, int worker);
/// Names the calling thread (15 letters at most) and makes its sleeps end on time; never raises it.
void set_up_helper_thread(const char* name);

/// Demotes every raised thread to SCHED_OTHER. Safe to call from a signal handler.
void demote_raised_threads() noexcept;
/// Processor time that a running thread has used; 0 where it is not known. Thread: any.
[[nodiscard]] std::chrono::nanoseconds processor_time(pthread_t thread) noexcept;

/// Whether a thread that was raised has been put back because it did not sleep.
[[nodiscard]] bool simulation_was_demoted() noexcept;

/// What the calling thread has suffered since it began.
struct ThreadUsage {
  std::uint64_t minor_faults = 0;          ///< pages mapped at first touch
  std::uint64_t major_faults = 0;          ///< pages read from disk
  std::uint64_t involuntary_switches = 0;  ///< times another thread took the core
  std::uint64_t voluntary_switches = 0;    ///< sleeps

  [[nodiscard]] static ThreadUsage of_this_thread() noexcept;
  [[nodiscard]] ThreadUsage since(const ThreadUsage& earlier) const noexcept;
};

/// What decides whether a thread may be raised and memory be locked.
struct RightsFacts {
  bool cap_sys_nice = false;
  bool cap_ipc_lock = false;
  std::uint64_t rtprio_limit = 0;
  std::uint64_t memlock_limit_bytes = 0;  ///< UINT64_MAX: no limit
  bool container = false;

  [[nodiscard]] static RightsFacts of_this_process();
};

/// Which right SCHED_FIFO at a priority lacks, and how to get it.
[[nodiscard]] std::string fifo_refusal(const RightsFacts& facts, int priority);
/// Which right locking the memory lacks, and how to get it.
[[nodiscard]] std::string memory_lock_refusal(const RightsFacts& facts);

}  // namespace merkel
