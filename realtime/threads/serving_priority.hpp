#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <sys/types.h>

#include "realtime/threads/processor_share.hpp"
#include "realtime/threads/raised_threads.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {

/// A real-time priority just below that of the simulation, for the threads that serve it: those
/// that read devices and those that pass on commands.
///
/// A thread that computes for more than half of the time loses it, so that a device or a peer that
/// floods the thread does not disturb the simulation. Thread: one.
class ServingPriority {
 public:
  /// Raises the calling thread and others that work for it, where the rights suffice.
  /// \param simulation  settings of the simulation thread; none: raises no thread
  /// \param others      their numbers in the kernel; they outlive this object
  explicit ServingPriority(const std::optional<RealtimeSettings>& simulation,
                           std::span<const pid_t> others = {});

  /// Demotes threads that compute too much. Call it in each round of the thread's work.
  void check(std::chrono::nanoseconds now) noexcept;

  /// The number of threads that have the priority.
  [[nodiscard]] std::size_t raised() const noexcept { return threads_.size(); }

 private:
  struct Thread {
    pid_t number = 0;
    RaisedThread raised;
    ProcessorShare share{kMax, kWindow};
  };
  static constexpr double kMax = 0.5;
  static constexpr std::chrono::milliseconds kWindow{200};

  std::vector<Thread> threads_;
};

}  // namespace merkel
