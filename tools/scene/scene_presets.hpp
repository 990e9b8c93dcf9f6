#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/scene/scene_file.hpp"

namespace merkel {

/// The scenes that come with the program, by name.
[[nodiscard]] std::optional<Scene> preset_scene(std::string_view name);
[[nodiscard]] const std::vector<std::string>& preset_names();

/// The membrane step that suits a neuron.
[[nodiscard]] std::chrono::nanoseconds usual_step(NeuronKind kind) noexcept;

/// What a command was given: nothing (the paper's scene), a preset's name, or a scene file.
[[nodiscard]] Expected<Scene, SetupError> scene_named(const std::string& name_or_file);

}  // namespace merkel
