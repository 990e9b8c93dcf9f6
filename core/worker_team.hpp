#pragma once

#include "core/realtime_tag.hpp"

namespace merkel {

/// Threads that share the work of one call. core creates no threads; realtime implements
/// this interface.
class WorkerTeam {
 public:
  using Part = void (*)(void* context, int part) noexcept;

  /// How many parts run at the same time, including the caller's.
  [[nodiscard]] virtual int size() const noexcept = 0;
  /// Calls `part` for 0 … parts−1, each on its own thread, and returns when all are done. Never
  /// sleeps.
  /// \param parts  at most size()
  /// Real-time: yes. Thread: simulation.
  virtual void run(int parts, Part part, void* context) noexcept MERKEL_REALTIME = 0;
  /// Within run(): returns once every part has called it. Never sleeps. Real-time: yes.
  virtual void barrier() noexcept MERKEL_REALTIME = 0;

 protected:
  ~WorkerTeam() = default;
};

}  // namespace merkel
