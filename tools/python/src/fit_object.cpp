#include "tools/python/src/fit_object.hpp"

#include <exception>
#include <string>
#include <utility>
#include <vector>

#include <cxxabi.h>
#include <pybind11/stl.h>

#include "tools/python/src/interpreter_exit.hpp"
#include "tools/python/src/records.hpp"
#include "tools/python/src/scene_object.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/studies/score/fit.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel::python {
namespace {

namespace py = pybind11;

Recordings recordings_of(const SceneObject& scene, const std::string& data) {
  auto recordings = recordings_named(data, scene.scene().probes.front().input.contact);
  if (!recordings) throw Error(recordings.error().sentence);
  return std::move(*recordings);
}

py::dict fit_scene(const SceneObject& given, const std::string& data,
                   const std::vector<std::string>& names, std::size_t trials, int evaluations,
                   std::size_t threads, const py::object& elsewhere) {
  Scene scene = given.scene();
  const Recordings recordings = recordings_of(given, data);
  std::exception_ptr raised;  // no exception passes through the optimiser
  FitResponses responses;
  if (!elsewhere.is_none()) {
    responses = [&](const std::vector<double>& values) {
      const GilAcquire gil;
      try {
        return elsewhere(values).cast<std::vector<double>>();
      } catch (const abi::__forced_unwind&) {
        wait_for_exit();  // the interpreter ended in a daemon thread
      } catch (...) {
        raised = std::current_exception();
        return std::vector<double>();
      }
    };
  }
  const auto goes_on = [&](double /*share*/) {
    const GilAcquire gil;
    if (raised || PyErr_CheckSignals() == 0) return !raised;
    raised = std::make_exception_ptr(py::error_already_set());
    return false;
  };
  auto result = [&] {
    const GilRelease release;
    return fit(scene.model, recordings.sets, names, trials, evaluations, goes_on, threads,
               responses);
  }();
  if (raised) std::rethrow_exception(raised);
  if (!result) throw Error(result.error().sentence);
  set_fitted(scene.model, *result);
  py::list parameters;
  for (const FittedParameter& fitted : result->parameters) {
    py::dict row;
    row["name"] = fitted.parameter.name;
    row["before"] = fitted.before;
    row["after"] = fitted.after;
    row["relative_error"] = fitted.relative_error;
    parameters.append(row);
  }
  py::dict out;
  out["scene"] = py::cast(SceneObject::of_text(scene_text(scene)));
  out["parameters"] = parameters;
  out["cost_before"] = result->cost_before;
  out["cost_after"] = result->cost_after;
  out["evaluations"] = result->evaluations;
  out["condition"] = result->condition;
  out["determined"] = result->determined();
  return out;
}

}  // namespace

void add_fit(py::module_& module) {
  module.def("_fit", &fit_scene);
  module.def("_fit_points", [](const SceneObject& scene, const std::string& data) {
    return fit_points(recordings_of(scene, data).sets);
  });
  module.def("_fit_part", [](const SceneObject& scene, const std::string& data,
                             const std::vector<std::string>& names, std::size_t trials,
                             std::size_t part, std::size_t parts) {
    auto responses = [&] {
      const Recordings recordings = recordings_of(scene, data);
      const GilRelease release;
      return or_throw(fit_part(scene.scene().model, recordings.sets, names, trials, part, parts));
    }();
    return py::cpp_function(std::move(responses), py::call_guard<GilRelease>());
  });
}

}  // namespace merkel::python
