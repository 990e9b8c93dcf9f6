#pragma once

#include <chrono>
#include <cstddef>
#include <mutex>

#include "core/realtime_tag.hpp"
#include "core/records/given_drive.hpp"
#include "realtime/queues/bounded_queue.hpp"

namespace merkel {

/// Passes the drives of an encoder of the user's own to the loop.
class DriveInput {
 public:
  static constexpr std::size_t kCapacity = 1024;

  /// False if kCapacity wait: the loop has not begun, or is over. Thread: any.
  [[nodiscard]] bool give(const GivenDrive& drive) {
    const std::lock_guard lock(givers_);
    return queue_.try_push(drive);
  }
  /// Calls work(drive) for each one that waits, stamped with the end of the present tick.
  /// Real-time: yes. Thread: simulation.
  template <class Work>
  void take(std::chrono::nanoseconds end, const Work& work) noexcept MERKEL_REALTIME {
    GivenDrive drive;
    for (std::size_t i = 0; i < kCapacity && queue_.try_pop(drive); ++i) {
      drive.time = end;
      work(drive);
    }
  }

 private:
  std::mutex givers_;  ///< never held by the loop
  BoundedQueue<GivenDrive> queue_{kCapacity};
};

}  // namespace merkel
