#pragma once

#include <cstdint>
#include <optional>

#include "core/expected.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sinks/sink_setup.hpp"
#include "tools/scene_file.hpp"

namespace merkel {

/// What sinks are told of a run. Everything its spikes depend on besides the tick inputs is among
/// the facts. \param seed  what --seed has set, if anything
[[nodiscard]] RunDescription describe_run(const Scene& scene, const TactileModel& model,
                                          std::optional<std::uint64_t> seed);

/// The scene that a session was recorded with, indenters and seeds included.
[[nodiscard]] Expected<Scene, SetupError> scene_of_session(const SessionReader& session);

}  // namespace merkel
