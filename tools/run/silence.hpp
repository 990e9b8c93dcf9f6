#pragma once

#include <string>

#include "core/scene/tactile_model.hpp"
#include "realtime/pipeline.hpp"

namespace merkel {

/// Explains why no afferent fired in a run and what to do, with computed numbers; empty if one
/// fired. The threshold is found by simulating slow presses (0.5 s to the full depth or force, then
/// 0.5 s of hold) at the position of the run's deepest press.
/// Real-time: no; takes about as long as a few seconds of the scene.
[[nodiscard]] std::string silence_text(const RunReport& report, const TactileModel& model);

}  // namespace merkel
