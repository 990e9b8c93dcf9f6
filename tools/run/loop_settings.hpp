#pragma once

#include "realtime/clocks/periodic_clock.hpp"
#include "realtime/threads/thread_setup.hpp"
#include "tools/scene/scene_table.hpp"

namespace merkel {

/// How a scene's [loop] meets the host's time.
struct LoopSettings {
  LoopWait wait = LoopWait::kHybrid;
  int threads = 1;  ///< that share a tick's work
  RealtimeSettings realtime;

  [[nodiscard]] Expected<void, ParameterError> check() const { return realtime.check(); }
};

/// Reads the keys wait, threads, scheduler, priority, cpu, lock_memory and cpu_awake.
void read_loop_settings(SceneTable& table, LoopSettings& loop);

}  // namespace merkel
