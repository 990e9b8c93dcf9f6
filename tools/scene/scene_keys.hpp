#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/parameters/field.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// The keys of [loop], borrowed from a scene.
[[nodiscard]] BoundFields loop_keys(Scene& scene);
/// The keys of [accuracy], borrowed from a scene.
[[nodiscard]] BoundFields accuracy_keys(Scene& scene);
/// The keys of the [[probe]] with index `probe`, borrowed from a scene. The words of `patch` are
/// the names of the scene's patches.
[[nodiscard]] BoundFields probe_keys(Scene& scene, std::size_t probe);

/// The keys of the [[electrode_group]] number `group`, from 0, borrowed from a scene.
[[nodiscard]] BoundFields group_keys(Scene& scene, std::size_t group);
/// The keys of the [[electrode]] number `electrode`, from 0, borrowed from a scene; first those of
/// its patch and its group, which decides about the others.
[[nodiscard]] BoundFields electrode_keys(Scene& scene, std::size_t electrode);

/// A table of a scene file with its keys.
struct SceneSection {
  std::string heading;  ///< "[skin]" or "[[probe]]"
  std::string meaning;
  BoundFields keys;

  /// The heading without brackets.
  [[nodiscard]] std::string table() const {
    const auto begin = heading.find_first_not_of('[');
    return heading.substr(begin, heading.find(']') - begin);
  }
};
/// All tables of a scene except its sinks, in reading order, borrowed from it.
[[nodiscard]] std::vector<SceneSection> sections_of(Scene& scene);

/// A text as TOML writes it.
[[nodiscard]] std::string toml_string(std::string_view text);

/// A scene as a complete, commented scene file. parse_scene reads it back to the same scene.
[[nodiscard]] std::string scene_text(const Scene& scene);

/// All keys of scene files with unit, range, default and meaning, as Markdown.
[[nodiscard]] std::string scene_keys_text();

}  // namespace merkel
