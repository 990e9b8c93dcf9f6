#pragma once

#include <atomic>
#include <utility>

#include <sys/types.h>

namespace merkel {

/// A thread with a real-time priority, which demote_raised_threads() finds as long as this exists.
class RaisedThread {
 public:
  explicit RaisedThread(pid_t thread) noexcept;
  RaisedThread(RaisedThread&& other) noexcept;
  RaisedThread& operator=(RaisedThread&& other) noexcept {
    std::swap(slot_, other.slot_);
    return *this;
  }
  ~RaisedThread();

 private:
  std::atomic<pid_t>* slot_ = nullptr;
};

/// The number of the calling thread in the kernel.
[[nodiscard]] pid_t this_thread() noexcept;

/// Requests SCHED_FIFO for a thread of this process; its children stay in SCHED_OTHER. When a
/// real-time thread computes for 0.5 s without a sleep, all of them are demoted to SCHED_OTHER so
/// that they cannot freeze the machine. If even that fails, the kernel kills the process after 2 s
/// (RLIMIT_RTTIME).
[[nodiscard]] bool request_fifo(pid_t thread, int priority) noexcept;

/// Demotes every real-time thread to SCHED_OTHER. Safe to call from a signal handler.
void demote_raised_threads() noexcept;

/// Whether a real-time thread was demoted because it did not sleep.
[[nodiscard]] bool simulation_was_demoted() noexcept;
/// A new simulation starts.
void forget_demotions() noexcept;

}  // namespace merkel
