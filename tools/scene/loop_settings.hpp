#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "core/parameters/parameter_error.hpp"
#include "realtime/clocks/periodic_clock.hpp"
#include "realtime/input/probe_input.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {

/// A probe's input between two samples: the first one, or their linear interpolation.
enum class Interpolation : std::uint8_t { kHold, kLinear };

/// Settings of a scene's loop on the host, apart from the length of its ticks.
struct LoopSettings {
  /// Default: derived from the probe's samples.
  std::optional<std::chrono::nanoseconds> stale_after;
  Interpolation interpolation = Interpolation::kLinear;
  std::optional<std::int64_t> max_catch_up_ticks;  ///< default: the pipeline's
  LoopWait wait = LoopWait::kHybrid;
  int threads = 1;  ///< share the work of a tick
  RealtimeSettings realtime;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
};

}  // namespace merkel
