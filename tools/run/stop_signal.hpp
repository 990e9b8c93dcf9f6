#pragma once

#include <atomic>

#include "realtime/pipeline.hpp"

namespace merkel {

/// While it lives, SIGINT, SIGTERM and SIGHUP end a run within a tick, so that its sinks are closed
/// and its summary is whole. A second one closes the sinks without waiting for whoever reads them;
/// a fourth one ends the program at once. One at a time.
class StopSignal {
 public:
  explicit StopSignal(Pipeline& pipeline);
  /// Sets a flag instead; borrowed.
  explicit StopSignal(std::atomic<bool>& flag);
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;
  ~StopSignal();
};

}  // namespace merkel
