#pragma once

#include <span>

#include "core/expected.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/bench/measure.hpp"

namespace merkel {

/// Time of one tick of a scene under constant presses, s. The presses change slightly at every
/// tick, as a real probe's do, so that no computation is skipped because of equal input.
/// \param presses  one per indenter; depth 0 does not touch
[[nodiscard]] Expected<Measurement, ParameterError> tick_cost(const TactileModel::Parameters& scene,
                                                              std::span<const ContactInput> presses,
                                                              WorkerTeam* team = nullptr,
                                                              int runs = 7);

/// Duration of each stage of a tick, run separately, µs. The scene has one patch and one probe.
struct StageCosts {
  double contact = 0.0;  ///< probe sample → contact and its reach
  double drive = 0.0;    ///< contact → input of the afferents
  double neurons = 0.0;  ///< input → spikes
  double publish = 0.0;  ///< the tick's spikes and record → the queue of one consumer
};
[[nodiscard]] Expected<StageCosts, ParameterError> stage_costs(
    const TactileModel::Parameters& scene, const ContactInput& press);

}  // namespace merkel
