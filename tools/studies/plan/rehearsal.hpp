#pragma once

#include <chrono>
#include <vector>

#include "core/expected.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// What a scene's probes do for a while, tick by tick, from shortly before the first touch.
struct Rehearsal {
  std::vector<std::vector<ContactInput>> ticks;  ///< of each tick: one contact an indenter
  bool stand_in = false;  ///< a device cannot be asked beforehand: a 1.5 mm ramp-and-hold instead
  std::size_t untouched = 0;  ///< ticks in which no probe touches
};

/// Reads recorded and simulated probes; `scene`'s indenters get their control. Fails where one
/// cannot be opened. \param most  how long at most
[[nodiscard]] Expected<Rehearsal, SetupError> rehearse(Scene& scene, std::chrono::nanoseconds most);

/// All spikes of a model, from rest, as a rehearsal's probes press it.
[[nodiscard]] std::vector<SpikeEvent> run_through(TactileModel& model, const Rehearsal& rehearsal);

}  // namespace merkel
