#pragma once

#include <string>

#include "drivers/sinks/sink_setup.hpp"

namespace merkel {

/// The constant description of a run: scene, patches, receptors, probes, parameters. It is the JSON
/// object that a page receives first.
/// \param control  whether the page may control the run
[[nodiscard]] std::string view_scene_json(const SinkSetup& setup, bool control);

}  // namespace merkel
