#pragma once

#include "core/realtime_tag.hpp"

namespace merkel {

/// Several threads that share the work of one call. core knows no thread: this is all it asks of
/// them; realtime provides it.
class WorkerTeam {
 public:
  using Part = void (*)(void* context, int part) noexcept;

  /// How many parts are done at the same time, the caller's own included.
  [[nodiscard]] virtual int size() const noexcept = 0;
  /// Calls `part` for 0 … parts−1, on as many threads, and returns when all are done. Never sleeps.
  /// \param parts  at most size().  Real-time: yes. Thread: simulation.
  virtual void run(int parts, Part part, void* context) noexcept MERKEL_REALTIME = 0;
  /// Within run(): returns once every part has called it. Never sleeps. Real-time: yes.
  virtual void barrier() noexcept MERKEL_REALTIME = 0;

 protected:
  ~WorkerTeam() = default;
};

}  // namespace merkel
