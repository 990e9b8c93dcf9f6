#pragma once

#include <chrono>
#include <memory>
#include <vector>

#include "core/realtime_tag.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {

/// Notices when a core of this machine does not run, because a hypervisor or an interrupt took it
/// away: no thread on the core receives anything meanwhile.
///
/// A thread on each core sleeps for a millisecond at a time, above the priority of the
/// simulation; a late wake-up is a stall of its core. Without the right to that priority, or with
/// many cores, there are no such threads and no stalls are found.
class StallWatch {
 public:
  using Time = std::chrono::nanoseconds;
  static constexpr Time kPeriod{1'000'000};
  static constexpr Time kMin{500'000};  ///< by which a wake-up is late
  static constexpr int kMaxCores = 8;

  struct Stall {
    Time begin{0};
    Time end{0};
  };

  /// Starts the threads. \param settings  of the simulation thread
  explicit StallWatch(const RealtimeSettings& settings);
  StallWatch(const StallWatch&) = delete;
  StallWatch& operator=(const StallWatch&) = delete;
  ~StallWatch();

  /// Takes the next stall that a core has reported. False if there is none.
  /// Real-time: yes. Thread: one.
  [[nodiscard]] bool take(Stall& stall) noexcept MERKEL_REALTIME;

 private:
  struct Core;
  std::vector<std::unique_ptr<Core>> cores_;
};

}  // namespace merkel
