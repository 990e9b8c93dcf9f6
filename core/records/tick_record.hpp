#pragma once

#include <chrono>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "core/records/contact_input.hpp"
#include "core/records/contact_state.hpp"
#include "core/records/touch.hpp"

namespace merkel {

/// The input of one probe that the loop used for one tick: plain data that crosses threads. The
/// spikes of a run depend only on its records, whatever was late, held or lost on the way.
struct TickRecord {
  enum class State : std::uint8_t {
    kFollowing,  ///< the contact is interpolated from the samples around the tick's end
    kHeld,       ///< the last sample was held: none had arrived in time
    kReleased,   ///< no contact: the probe was silent for too long
    kEnded,      ///< the recording has ended; its last sample is held until stale
  };

  std::chrono::nanoseconds time{0};  ///< probe time of the tick's end
  /// Host time from the tick's deadline to the publication of its spikes; 0 on a virtual clock
  /// and while the backlog of the start is caught up.
  std::chrono::nanoseconds latency{0};
  /// Of the loop at this tick: the deadline is the tick's end plus the delay. The spikes do not
  /// depend on it.
  std::chrono::nanoseconds delay{0};
  ContactInput contact;      ///< at the tick's end
  Press press;               ///< that the model made of it; sessions do not store it
  std::uint64_t number = 0;  ///< counts simulated ticks from 1; a jump is a lost record
  std::uint32_t probe = 0;   ///< from 0
  std::uint16_t late = 0;    ///< samples found at this tick after their time was simulated
  State state = State::kFollowing;
  std::uint8_t doubts = 0;  ///< of the samples in effect: ProbeSample::Doubt bits
  Touch touch = Touch::kUndecided;
  std::uint16_t taxel_blocks = 0;  ///< of a tactile array: number of its TaxelBlocks of this tick
};

static_assert(std::is_trivially_copyable_v<TickRecord>);

/// Whether a probe touches at a tick; if that is undecided, by any positive depth or force.
[[nodiscard]] constexpr bool touches(const TickRecord& tick) noexcept {
  return tick.touch == Touch::kUndecided
             ? tick.contact.depth_mm > 0.0 || tick.contact.force_mN > 0.0
             : tick.touch == Touch::kTouching;
}

/// "following", "held", "released", "ended".
[[nodiscard]] constexpr std::string_view name_of(TickRecord::State state) noexcept {
  switch (state) {
    case TickRecord::State::kFollowing:
      return "following";
    case TickRecord::State::kHeld:
      return "held";
    case TickRecord::State::kReleased:
      return "released";
    case TickRecord::State::kEnded:
      return "ended";
  }
  return "";
}

}  // namespace merkel
