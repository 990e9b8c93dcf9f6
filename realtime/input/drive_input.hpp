#pragma once

#include <chrono>
#include <cstddef>
#include <mutex>

#include "core/realtime_tag.hpp"
#include "core/records/given_drive.hpp"
#include "realtime/queues/bounded_queue.hpp"
#include "realtime/threads/host_time.hpp"

namespace merkel {

/// Passes the drives of an encoder of the user's own to the loop.
class DriveInput {
 public:
  static constexpr std::size_t kCapacity = 1024;

  /// False if kCapacity wait: the loop has not begun, or is over. Thread: any.
  [[nodiscard]] bool give(const GivenDrive& drive) {
    const std::lock_guard lock(givers_);
    return queue_.try_push({drive, host_now()});
  }
  /// Calls work(drive) for each one that waits, stamped with the end of the present tick. One that
  /// was given before `oldest`, while the loop had not begun or hung, is dropped.
  /// Real-time: yes. Thread: simulation. \param oldest  host time; of a virtual clock all are newer
  template <class Work>
  void take(std::chrono::nanoseconds end, std::chrono::nanoseconds oldest,
            const Work& work) noexcept MERKEL_REALTIME {
    Given given;
    for (std::size_t i = 0; i < kCapacity && queue_.try_pop(given); ++i) {
      if (given.at < oldest) continue;
      given.drive.time = end;
      work(given.drive);
    }
  }

 private:
  struct Given {
    GivenDrive drive;
    std::chrono::nanoseconds at{0};  ///< host time
  };

  std::mutex givers_;  ///< never held by the loop
  BoundedQueue<Given> queue_{kCapacity};
};

}  // namespace merkel
