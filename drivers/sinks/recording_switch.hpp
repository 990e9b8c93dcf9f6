#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "drivers/sinks/sink_setup.hpp"

namespace merkel {

/// Through which one sink starts and stops the recording that another makes. Thread: any.
class RecordingSwitch {
 public:
  /// Says that somebody will use the switch.
  void offer() noexcept { offered_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool offered() const noexcept { return offered_.load(std::memory_order_relaxed); }

  void want(bool on) noexcept { wanted_.store(on, std::memory_order_relaxed); }
  [[nodiscard]] bool wanted() const noexcept { return wanted_.load(std::memory_order_relaxed); }

  /// What became of it: whether a recording goes on, and a sentence for a person.
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
  std::atomic<bool> wanted_{false};
  std::atomic<bool> recording_{false};
  std::mutex mutex_;
  std::vector<std::string> notices_;
};

/// A sink that records sessions while its switch is on, each into a file of its own in the current
/// folder: session-YYYYMMDD-HHMMSS.xdf. A recording that fails is reported through the switch, and
/// the run goes on.
[[nodiscard]] std::unique_ptr<SpikeSink> session_on_request(
    std::shared_ptr<RecordingSwitch> recording, SinkSetup setup);

}  // namespace merkel
