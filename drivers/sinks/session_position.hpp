#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

namespace merkel {

/// Where a session is being played, shared by the player and by sinks that steer it. Thread: any.
struct SessionPosition {
  std::chrono::nanoseconds start{0};  ///< probe time of the session's first tick begins here
  double length_s = 0.0;
  std::atomic<bool> hold{false};        ///< the player waits
  std::atomic<double> seek_s{-1.0};     ///< where to go, from the start; negative: nowhere
  std::atomic<std::uint32_t> jumps{0};  ///< how often the player has gone elsewhere
};

}  // namespace merkel
