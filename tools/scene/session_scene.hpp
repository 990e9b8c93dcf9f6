#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/probe.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sink_setup.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// The description of a run for sinks. Together with the tick inputs, its facts determine the
/// spikes.
[[nodiscard]] RunDescription describe_run(const Scene& scene, const TactileModel& model);

/// Adds the facts of a probe and of its calibration. Call once per probe, in order.
void add_probe_facts(const ProbeInfo& probe, RunDescription& run);

/// The probes of a session, with the channels that their samples carry. Reads ahead to the
/// first sample of each.
[[nodiscard]] Expected<std::vector<ProbeInfo>, SetupError> probes_of_session(
    const std::string& path);

/// Sets the probes of a scene, as Scene::set_probes does. A single session that holds as many
/// probes as the scene has feeds each by its own.
[[nodiscard]] Expected<void, SetupError> set_probes(Scene& scene, std::vector<std::string> uris);

/// The description of a recorded run for sinks that store a copy: the facts are those of the
/// machine and the time of the recording. \param scene  null of samples recorded without a
/// simulation
[[nodiscard]] Expected<RunDescription, SetupError> describe_session(const std::string& path,
                                                                    const SessionReader& session,
                                                                    const Scene* scene);

/// Converts the neuron numbers of a session's spikes to those of the model. Early sessions
/// number the neurons of each patch from 1.
class SessionNumbering {
 public:
  /// Whether a session is an early one.
  [[nodiscard]] static bool needed(const SessionReader& session);
  SessionNumbering(const SessionReader& session, const TactileModel& model);
  void apply(SessionChunk& chunk) const;

 private:
  std::vector<std::uint32_t> before_patch_;  ///< offset of each patch; empty: none
};

/// The scene of a session, including indenters and seeds.
[[nodiscard]] Expected<Scene, SetupError> scene_of_session(const SessionReader& session);

}  // namespace merkel
