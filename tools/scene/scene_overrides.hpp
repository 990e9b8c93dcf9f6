#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/parameters/field.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// A key of a scene by its name: "skin.radius_mm"; in a repeated table "probe.x_mm",
/// "probe[1].x_mm". Borrows the scene.
struct NamedKey {
  std::string name;
  BoundField key;
};

/// All keys of a scene, in the order of a scene file.
[[nodiscard]] std::vector<NamedKey> named_keys(Scene& scene);
/// One of them; "probe[0].x_mm" is "probe.x_mm". Fails with the nearest name.
[[nodiscard]] Expected<BoundField, SetupError> key_named(Scene& scene, const std::string& name);

/// The scene that a file of a changed scene's keys describes: checked, and complete in its text.
/// \param before  the scene whose keys were changed: its measured shapes keep their heights
[[nodiscard]] Expected<Scene, SetupError> scene_of_keys(Scene changed, const Scene& before);

/// Names of keys and their values, as in a scene file; texts and words also without quotes.
using SceneOverrides = std::vector<std::pair<std::string, std::string>>;
/// Of texts KEY=VALUE, in the same order.
[[nodiscard]] Expected<SceneOverrides, SetupError> overrides_of(
    const std::vector<std::string>& texts);

/// The scene with other values of some keys, set in the given order. Fails, and names the key, if a
/// scene file with these values would be refused.
[[nodiscard]] Expected<Scene, SetupError> with_overrides(const Scene& scene,
                                                         const SceneOverrides& overrides);

}  // namespace merkel
