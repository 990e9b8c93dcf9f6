#pragma once

#include "core/expected.hpp"
#include "drivers/probe.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sinks/sink_setup.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// What sinks are told of a run. Everything its spikes depend on besides the tick inputs is among
/// the facts.
[[nodiscard]] RunDescription describe_run(const Scene& scene, const TactileModel& model);

/// Notes what a probe is and how its readings are calibrated. Once for each, in their order.
void add_probe_facts(const ProbeInfo& probe, RunDescription& run);

/// The scene that a session was recorded with, indenters and seeds included.
[[nodiscard]] Expected<Scene, SetupError> scene_of_session(const SessionReader& session);

}  // namespace merkel
