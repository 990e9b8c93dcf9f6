#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/receptors/receptor_placement.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/spike_sink.hpp"

namespace merkel {

/// What a run is, for sinks that tell it on.
struct RunDescription {
  std::string scene;  ///< its name, for people
  /// Everything that the run depends on or that a reader may ask later (version, scene text,
  /// seeds, machine), by name. Names are letters, digits and underscores.
  std::vector<std::pair<std::string, std::string>> facts;
  TactileModel::Parameters model;
  std::vector<std::vector<Receptor>> receptors;  ///< by patch
};

/// How sinks are opened.
struct SinkSetup {
  std::uint32_t neurons = 0;  ///< of the model; spikes number them from 1
  bool overwrite = false;     ///< existing files may be replaced
  bool allow_remote = false;  ///< other machines may be sent to, or connect
  RunDescription run;
};

}  // namespace merkel
