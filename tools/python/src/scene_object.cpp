#include "tools/python/src/scene_object.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <type_traits>
#include <variant>

#include <pybind11/stl.h>

#include "core/parameters/field.hpp"
#include "core/parameters/nearest_name.hpp"
#include "tools/python/src/records.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_overrides.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel::python {
namespace {

namespace py = pybind11;

/// Python's and numpy's truth values.
bool is_truth(const py::handle& value) {
  return py::isinstance<py::bool_>(value) ||
         py::isinstance(value, py::module_::import("numpy").attr("bool_"));
}

/// Python's and numpy's whole numbers; True is none.
bool is_whole(const py::handle& value) {
  return !is_truth(value) && PyIndex_Check(value.ptr()) != 0;
}

/// The same for all real numbers; an array is none.
bool is_number(const py::handle& value) {
  const auto* const numbers = Py_TYPE(value.ptr())->tp_as_number;
  if (is_truth(value) || (py::hasattr(value, "__iter__") && py::len_hint(value) > 0)) return false;
  return is_whole(value) || (numbers != nullptr && numbers->nb_float != nullptr);
}

struct ToPython {
  const BoundField& key;

  py::object operator()(std::chrono::nanoseconds value) const {
    return py::float_(static_cast<double>(value.count()) / nanoseconds_of_unit(key.field->unit));
  }
  py::object operator()(const Position& value) const {
    return py::make_tuple(value.x_mm, value.y_mm);
  }
  template <class T>
  py::object operator()(const std::vector<T>& values) const {
    py::list list;
    for (const T& value : values) list.append((*this)(value));
    return list;
  }
  template <class T>
  py::object operator()(const std::optional<T>& value) const {
    return value ? (*this)(*value) : py::none();
  }
  py::object operator()(const Choice& choice) const {
    const auto index = choice.get(choice.value);
    if (!index || *index >= key.words.size()) return py::none();
    return py::str(key.words[*index]);
  }
  template <class T>
  py::object operator()(const T& value) const {
    return py::cast(value);
  }
};

/// Sets a value from Python; false if it has the wrong type.
struct FromPython {
  const BoundField& key;
  py::handle value;

  bool operator()(double& to) const {
    if (!is_number(value)) return false;
    to = py::float_(py::reinterpret_borrow<py::object>(value));
    return true;
  }
  bool operator()(bool& to) const {
    if (!is_truth(value)) return false;
    to = py::bool_(py::reinterpret_borrow<py::object>(value));
    return true;
  }
  bool operator()(std::string& to) const {
    if (!py::isinstance<py::str>(value)) return false;
    to = value.cast<std::string>();
    return true;
  }
  template <class Whole>
  requires std::is_integral_v<Whole>
  bool operator()(Whole& to) const {
    if (!is_whole(value)) return false;
    to = value.cast<Whole>();  // throws where it does not fit
    return true;
  }
  bool operator()(std::chrono::nanoseconds& to) const {
    double amount = 0.0;
    if (!(*this)(amount) || !(std::fabs(amount) < 1e12)) return false;
    to = std::chrono::nanoseconds{std::llround(amount * nanoseconds_of_unit(key.field->unit))};
    return true;
  }
  bool operator()(Position& to) const {
    std::vector<double> both;
    if (!(*this)(both) || both.size() != 2) return false;
    to = {.x_mm = both[0], .y_mm = both[1]};
    return true;
  }
  template <class T>
  bool operator()(std::vector<T>& to) const {
    if (!py::isinstance<py::iterable>(value) || py::isinstance<py::str>(value)) return false;
    std::vector<T> all;
    for (const py::handle each : py::reinterpret_borrow<py::iterable>(value)) {
      if (!FromPython{key, each}(all.emplace_back())) return false;
    }
    to = std::move(all);
    return true;
  }
  template <class T>
  bool operator()(std::optional<T>& to) const {
    if (value.is_none()) {
      to.reset();
      return true;
    }
    return (*this)(to.emplace());
  }
  bool choose(const Choice& choice) const {
    std::string word;
    if (!(*this)(word)) return false;
    const auto found = std::find(key.words.begin(), key.words.end(), word);
    if (found == key.words.end()) {
      const std::string nearest = nearest_name(word, key.words);
      throw Error("must be one of " + listed(key.words) +
                  (nearest.empty() ? "" : "; did you mean " + nearest + "?"));
    }
    choice.set(choice.value, static_cast<std::size_t>(found - key.words.begin()));
    return true;
  }
};

/// One table of a scene, for `scene.skin.radius_mm`.
struct Table {
  py::object scene;
  std::string name;

  [[nodiscard]] SceneObject& object() const { return scene.cast<SceneObject&>(); }
};

}  // namespace
}  // namespace merkel::python

template <>
struct pybind11::detail::type_caster<merkel::python::Table>
    : merkel::python::Initialised<merkel::python::Table> {};

namespace merkel::python {

SceneObject SceneObject::named(const std::string& name_or_file) {
  return SceneObject(or_throw(scene_named(name_or_file)));
}

SceneObject SceneObject::of_text(const std::string& text) {
  return SceneObject(or_throw(parse_scene(text, "scene")));
}

py::object SceneObject::get(const std::string& name) {
  const BoundField key = or_throw(key_named(scene_, name));
  return std::visit(
      [&](const auto& value) -> py::object {
        if constexpr (std::is_same_v<decltype(value), const Choice&>) {
          return ToPython{key}(value);
        } else {
          return ToPython{key}(*value);
        }
      },
      key.value);
}

void SceneObject::set(const std::string& name, const py::handle& value) {
  Scene changed = scene_;
  const BoundField key = or_throw(key_named(changed, name));
  try {
    const bool fits = std::visit(
        [&](const auto& to) {
          if constexpr (std::is_same_v<decltype(to), const Choice&>) {
            return FromPython{key, value}.choose(to);
          } else {
            return FromPython{key, value}(*to);
          }
        },
        key.value);
    if (!fits) {
      throw Error("cannot be " + py::repr(value).cast<std::string>() + ": " +
                  std::string(key.field->meaning) +
                  (key.field->unit.empty() ? "" : ", in " + std::string(key.field->unit)));
    }
    if (const std::string fault = fault_of(key); !fault.empty()) throw Error(fault);
  } catch (const Error& error) {
    throw Error(name + " " + error.what());
  } catch (const py::cast_error&) {
    throw Error(name + " cannot be " + py::repr(value).cast<std::string>() +
                ": it is out of range");
  }
  if (name == "skin.radius_mm") flatten_if_infinite(changed.model.skin);
  scene_ = or_throw(scene_of_keys(std::move(changed), scene_));
}

std::string value_text(const py::handle& value) {
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  const auto object = py::reinterpret_borrow<py::object>(value);
  if (is_truth(value)) return py::bool_(object) ? "true" : "false";
  if (is_number(value)) {
    if (is_whole(value)) return py::str(py::int_(object));
    constexpr double kExact = 9007199254740992.0;
    const double number = py::float_(object);
    if (number != std::trunc(number) || !(std::fabs(number) < kExact))
      return shortest_decimal(number);
    return std::to_string(static_cast<std::int64_t>(number));
  }
  if (!py::isinstance<py::iterable>(value)) {
    throw Error("a value cannot be " + py::repr(value).cast<std::string>() +
                ": use a number, a text or a list");
  }
  return "[" + listed(object, value_text) + "]";
}

void SceneObject::override_keys(const SceneOverrides& overrides) {
  scene_ = or_throw(with_overrides(scene_, overrides));
}

std::vector<std::string> SceneObject::keys() {
  std::vector<std::string> names;
  for (NamedKey& each : named_keys(scene_)) names.push_back(std::move(each.name));
  return names;
}

bool SceneObject::has_table(const std::string& table) {
  const auto sections = sections_of(scene_);
  return std::any_of(sections.begin(), sections.end(),
                     [&](const SceneSection& section) { return section.table() == table; });
}

py::object table_named(const py::object& scene, const std::string& name) {
  if (!scene.cast<SceneObject&>().has_table(name)) {
    throw py::attribute_error("a scene has no " + name);
  }
  return py::cast(Table{scene, name});
}

void add_tables(py::module_& module) {
  py::class_<Table>(module, "Table")
      .def("__getattr__",
           [](const Table& table, const std::string& key) {
             try {
               return table.object().get(table.name + "." + key);
             } catch (const Error& error) {
               throw py::attribute_error(error.what());
             }
           })
      .def("__setattr__",
           [](const Table& table, const std::string& key, const py::object& value) {
             table.object().set(table.name + "." + key, value);
           })
      .def("__dir__",
           [](const Table& table) {
             std::vector<std::string> names;
             for (const std::string& key : table.object().keys()) {
               if (key.starts_with(table.name + ".")) {
                 names.push_back(key.substr(table.name.size() + 1));
               }
             }
             return names;
           })
      .def("__repr__", [](const Table& table) { return "<table " + table.name + " of a scene>"; });
}

}  // namespace merkel::python
