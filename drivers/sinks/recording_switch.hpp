#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "drivers/sink_setup.hpp"

namespace merkel {

/// Lets one sink start and stop the recording of another one. Thread: any.
class RecordingSwitch {
 public:
  /// Announces that the switch will be used.
  void offer() noexcept { offered_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool offered() const noexcept { return offered_.load(std::memory_order_relaxed); }

  void request(bool on) noexcept { requested_.store(on, std::memory_order_relaxed); }
  [[nodiscard]] bool requested() const noexcept {
    return requested_.load(std::memory_order_relaxed);
  }

  /// Reports whether a recording is active, with a message for the user.
  void report(bool recording, std::string sentence) {
    recording_.store(recording, std::memory_order_relaxed);
    const std::lock_guard lock(mutex_);
    notices_.push_back(std::move(sentence));
  }
  [[nodiscard]] bool recording() const noexcept {
    return recording_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::vector<std::string> take_notices() {
    const std::lock_guard lock(mutex_);
    return std::exchange(notices_, {});
  }

 private:
  std::atomic<bool> offered_{false};
  std::atomic<bool> requested_{false};
  std::atomic<bool> recording_{false};
  std::mutex mutex_;
  std::vector<std::string> notices_;
};

/// A sink that records sessions while its switch is on. Each is a new file in the current folder:
/// session-YYYYMMDD-HHMMSS.xdf. The switch reports the failure of a recording, and the run
/// continues.
[[nodiscard]] std::unique_ptr<Sink> session_on_request(std::shared_ptr<RecordingSwitch> recording,
                                                       SinkSetup setup);

}  // namespace merkel
