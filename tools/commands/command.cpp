#include "tools/commands/command.hpp"

#include "realtime/threads/spinning_team.hpp"
#include "tools/number_text.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {

std::string contents_of(const Scene& scene) {
  const std::size_t patches = scene.model.patches.size();
  return std::to_string(patches) + (patches == 1 ? " patch and " : " patches and ") +
         counted(scene.probes.size(), "probe");
}

std::size_t jobs_or_cores(const std::optional<double>& jobs) {
  return static_cast<std::size_t>(jobs.value_or(SpinningTeam::available_cores()));
}

}  // namespace merkel
