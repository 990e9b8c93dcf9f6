#pragma once

#include <span>

#include "core/expected.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/bench/measure.hpp"

namespace merkel {

/// Time of one tick of a scene while its probes press, s. The presses change a little at every
/// tick, as a real probe's do, so that nothing is left out because it is the same as before. \param
/// presses  one an indenter; depth 0 does not touch
[[nodiscard]] Expected<Measurement, ParameterError> tick_cost(const TactileModel::Parameters& scene,
                                                              std::span<const ContactInput> presses,
                                                              WorkerTeam* team = nullptr,
                                                              int runs = 7);

}  // namespace merkel
