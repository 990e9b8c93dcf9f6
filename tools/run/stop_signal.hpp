#pragma once

#include "realtime/pipeline.hpp"

namespace merkel {

/// While it lives, SIGINT and SIGTERM end a run within a tick, so that its sinks are flushed and
/// its summary is whole; a second one ends the program at once. One at a time.
class StopSignal {
 public:
  explicit StopSignal(Pipeline& pipeline);
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;
  ~StopSignal();
};

}  // namespace merkel
