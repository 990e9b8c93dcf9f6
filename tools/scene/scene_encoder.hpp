#pragma once

#include <memory>

#include "core/encoding/stimulation_encoder.hpp"
#include "core/expected.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// The encoder of a scene's electrodes for its model; null if there are none. Fails if an electrode
/// refers to something that the model does not have. Real-time: no.
[[nodiscard]] Expected<std::unique_ptr<StimulationEncoder>, SetupError> encoder_of(
    const Scene& scene, const TactileModel& model);

}  // namespace merkel
