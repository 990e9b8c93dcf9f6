#pragma once

#include "tools/scene/scene_file.hpp"
#include "tools/studies/plan/rehearsal.hpp"

namespace merkel {

/// Time per tick for the stimulation commands of a scene's electrodes, µs: the mean over a
/// rehearsal. Fails if the scene cannot be encoded.
[[nodiscard]] Expected<double, SetupError> encoding_cost_us(const Scene& scene,
                                                            const Rehearsal& rehearsal);

}  // namespace merkel
