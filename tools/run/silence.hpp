#pragma once

#include <string>

#include "core/scene/tactile_model.hpp"
#include "realtime/pipeline.hpp"

namespace merkel {

/// Why no afferent fired in a run and what to do, in sentences with computed numbers; empty where
/// one fired. The least press that makes one fire is found by simulating presses at the place of
/// the run's deepest one, as fast as that one and held for as long (0.5 s each at most).
/// Real-time: no; takes about as long as a few seconds of the scene.
[[nodiscard]] std::string silence_text(const RunReport& report, const TactileModel& model);

}  // namespace merkel
