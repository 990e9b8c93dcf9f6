#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

#include "drivers/stimulation_switch.hpp"

namespace merkel {

/// The position in a played session, shared by the player and controlling sinks. Thread: any.
struct SessionPosition {
  std::chrono::nanoseconds start{0};  ///< probe time of the start of the session's first tick
  double length_s = 0.0;
  std::atomic<bool> paused{false};      ///< the playback stands still
  std::atomic<double> seek_s{-1.0};     ///< target of a seek, from the start; negative: none
  std::atomic<std::uint32_t> jumps{0};  ///< number of seeks of the player
  StimulationSwitch stimulation;        ///< of the played commands
};

}  // namespace merkel
