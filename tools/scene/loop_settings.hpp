#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "core/parameters/parameter_error.hpp"
#include "realtime/clocks/periodic_clock.hpp"
#include "realtime/input/probe_input.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {

/// What a probe's input is between two samples: the first of them, or their linear interpolation.
enum class Interpolation : std::uint8_t { kHold, kLinear };

/// How the loop of a scene runs on the host, apart from the length of its ticks.
struct LoopSettings {
  /// What the probe's samples suggest, if not set.
  std::optional<std::chrono::nanoseconds> stale_after;
  Interpolation interpolation = Interpolation::kLinear;
  std::optional<std::int64_t> max_catch_up_ticks;  ///< the pipeline's default, if not set
  LoopWait wait = LoopWait::kHybrid;
  int threads = 1;  ///< that share a tick's work
  RealtimeSettings realtime;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
};

}  // namespace merkel
