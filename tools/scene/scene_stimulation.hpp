#pragma once

#include "tools/scene/scene_file.hpp"
#include "tools/scene/scene_table.hpp"

namespace merkel {

/// Reads [[electrode_group]], [[electrode]], [stimulation] and [stimulator] of a scene, and the
/// profile of a stimulator that [stimulation] names. Real-time: no.
void read_stimulation(SceneTable& root, SceneTable::Findings& findings, Scene& scene);

}  // namespace merkel
