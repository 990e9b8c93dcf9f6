#pragma once

#include <optional>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "tools/python/src/initialised.hpp"
#include "tools/scene/prepared_run.hpp"
#include "tools/scene/scene_file.hpp"
#include "tools/scene/scene_overrides.hpp"

namespace merkel::python {

/// The Python class Scene: a scene whose keys can be read and set.
class SceneObject {
 public:
  explicit SceneObject(Scene scene) : scene_(std::move(scene)) {}
  /// A preset or a scene file. \throws Error
  [[nodiscard]] static SceneObject named(const std::string& name_or_file);
  [[nodiscard]] static SceneObject of_text(const std::string& text);

  /// By name: "skin.radius_mm"; of a table that there is several times "probe[1].x_mm".
  /// \throws Error where there is no such key, naming the nearest
  [[nodiscard]] pybind11::object get(const std::string& key);
  /// \throws Error where the value has the wrong type or is out of range, and the scene stays as it
  /// was
  void set(const std::string& key, const pybind11::handle& value);
  /// Sets keys to values as in a scene file, all or none. \throws Error
  void override_keys(const SceneOverrides& overrides);
  /// All names, in the order of a scene file.
  [[nodiscard]] std::vector<std::string> keys();
  [[nodiscard]] bool has_table(const std::string& table);

  [[nodiscard]] const Scene& scene() const noexcept { return scene_; }
  [[nodiscard]] Scene& scene() noexcept { return scene_; }

  /// Where runs keep their model; null: they do not.
  [[nodiscard]] ModelCache* models() noexcept { return models_ ? &*models_ : nullptr; }
  void keep_model(bool keep) {
    models_.reset();
    if (keep) models_.emplace();
  }

 private:
  Scene scene_;
  std::optional<ModelCache> models_;
};

/// A value as in a scene file; texts and words without quotes. \throws Error where it is neither a
/// number, a text nor a list
[[nodiscard]] std::string value_text(const pybind11::handle& value);

/// Adds the tables of scenes, as in `scene.skin.radius_mm`, to the module.
void add_tables(pybind11::module_& module);

/// The table of a scene, for `scene.skin`. \throws AttributeError in Python where there is none
[[nodiscard]] pybind11::object table_named(const pybind11::object& scene, const std::string& name);

}  // namespace merkel::python

template <>
struct pybind11::detail::type_caster<merkel::python::SceneObject>
    : merkel::python::Initialised<merkel::python::SceneObject> {};
