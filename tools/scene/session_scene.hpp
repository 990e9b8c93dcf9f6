#pragma once

#include <cstdint>
#include <vector>

#include "core/expected.hpp"
#include "drivers/probe.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sinks/sink_setup.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// The description of a run for sinks. The facts hold everything that the spikes depend on besides
/// the tick inputs.
[[nodiscard]] RunDescription describe_run(const Scene& scene, const TactileModel& model);

/// Notes what a probe is and how its readings are calibrated. Once for each, in their order.
void add_probe_facts(const ProbeInfo& probe, RunDescription& run);

/// Gives the spikes of a session the neuron numbers that they have in the model. Early sessions
/// number the neurons of each patch from 1.
class SessionNumbering {
 public:
  SessionNumbering(const SessionReader& session, const TactileModel& model);
  void apply(SessionChunk& chunk) const;

 private:
  std::vector<std::uint32_t> before_patch_;  ///< to be added, by patch; empty: nothing
};

/// The scene that a session was recorded with, indenters and seeds included.
[[nodiscard]] Expected<Scene, SetupError> scene_of_session(const SessionReader& session);

}  // namespace merkel
