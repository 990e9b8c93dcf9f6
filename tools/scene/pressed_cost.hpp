#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "core/scene/tactile_model.hpp"

namespace merkel {

/// The median computing time of a tick while all probes press with 1 mm or 0.5 N (arrays: with 20
/// kPa; surfaces slide). Takes about 60 ticks, at most 50 ms beyond the first ten, and leaves the
/// model at rest, as reset() does. Real-time: no.
/// \param places  where each probe presses; only the positions count
/// \param now     the clock, read before and after each tick
[[nodiscard]] std::chrono::nanoseconds pressed_cost(
    TactileModel& model, std::vector<ContactInput> places,
    const std::function<std::chrono::nanoseconds()>& now);

/// What a user should know before a run in real time: a sentence if the pressed cost leaves less
/// than a fifth of the tick; else empty.
[[nodiscard]] std::string cost_warning(std::chrono::nanoseconds cost,
                                       std::chrono::nanoseconds tick);

}  // namespace merkel
