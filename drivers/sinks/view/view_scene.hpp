#pragma once

#include <string>

#include "drivers/sinks/sink_setup.hpp"

namespace merkel {

/// What stays the same during a run: scene, patches, receptors, probes, parameters. The JSON object
/// that a page receives first.
/// \param control  whether the page may steer the run
[[nodiscard]] std::string view_scene_json(const SinkSetup& setup, bool control);

}  // namespace merkel
