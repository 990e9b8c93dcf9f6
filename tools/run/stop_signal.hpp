#pragma once

#include <atomic>

#include "realtime/pipeline.hpp"

namespace merkel {

/// During its lifetime, SIGINT, SIGTERM and SIGHUP end a run within a tick; its sinks are closed
/// and its summary is printed. A second signal closes the sinks without waiting for their readers;
/// a fourth one ends the program at once. One object at a time.
class StopSignal {
 public:
  /// Ends nothing before it reaches a pipeline. Made before the sinks, whose files must be
  /// finished.
  StopSignal();
  explicit StopSignal(Pipeline& pipeline);
  /// Sets a flag instead; borrowed.
  explicit StopSignal(std::atomic<bool>& flag);
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;
  ~StopSignal();

  /// Ends this pipeline from now on, also by a signal that has arrived before.
  void reach(Pipeline& pipeline) noexcept;
  /// True if a signal has arrived during its lifetime.
  [[nodiscard]] bool requested() const noexcept;
};

}  // namespace merkel
