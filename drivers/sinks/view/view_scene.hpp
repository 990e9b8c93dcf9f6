#pragma once

#include <string>

#include "drivers/sink_setup.hpp"

namespace merkel {

/// The first message that a page receives: a JSON object with the constants of a run (scene,
/// patches, receptors, probes, parameters).
struct ViewScene {
  std::string viewing;   ///< for a page that may only watch
  std::string steering;  ///< for a page that may control the run; empty unless requested

  ViewScene(const SinkSetup& setup, bool steers);
};

}  // namespace merkel
