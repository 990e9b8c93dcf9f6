#pragma once

#include <array>
#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/scene/scene_file.hpp"

namespace merkel {

/// A built-in scene by its name.
[[nodiscard]] std::optional<Scene> preset_scene(std::string_view name);
/// What became of a preset of earlier versions, with its name; empty for any other name.
[[nodiscard]] std::string retired_preset(std::string_view name);
/// The smallest and the largest force of the spheres to which a preset's afferents are fitted;
/// empty for presets that are fitted to none.
[[nodiscard]] std::optional<std::array<double, 2>> fitted_forces_N(std::string_view preset);
[[nodiscard]] const std::vector<std::string>& preset_names();
/// A line for each preset: its name and its meaning.
[[nodiscard]] std::string preset_list(std::string_view before, std::string_view between);

/// The same of the examples that come with the program; empty where they are not installed.
[[nodiscard]] std::string example_scene_list(std::string_view before, std::string_view between);

/// The scene of a preset, of a scene file, of an example or of a recorded session, whose own sinks
/// are left out; for an empty name, the preset "paper".
[[nodiscard]] Expected<Scene, SetupError> scene_named(const std::string& name_or_file);

}  // namespace merkel
