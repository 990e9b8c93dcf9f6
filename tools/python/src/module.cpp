// The Python module merkel: scenes, batch runs, the model a sample at a time, the real-time
// pipeline and recorded sessions.
#include <csignal>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "drivers/probes/channel_selection.hpp"
#include "tools/batch/batch_identity.hpp"
#include "tools/batch/batch_job.hpp"
#include "tools/child_process.hpp"
#include "tools/program/program.hpp"
#include "tools/python/src/bridge_object.hpp"
#include "tools/python/src/fit_object.hpp"
#include "tools/python/src/interpreter_exit.hpp"
#include "tools/python/src/records.hpp"
#include "tools/python/src/run_object.hpp"
#include "tools/python/src/scene_object.hpp"
#include "tools/python/src/session_object.hpp"
#include "tools/python/src/stream_object.hpp"
#include "tools/scene/machine_facts.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_overrides.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel::python {
namespace {

namespace py = pybind11;

constexpr const char* kRunHelp =
    R"(Runs the scene as fast as possible, as `merkel run --fast` does, and returns its spikes.

The press is depth_mm (mm, positive into the skin) or force_N (N) or both, and x_mm, y_mm (mm) where the
probe moves: arrays of (samples,), or of (samples, probes) for a scene with several probes. Times are
time_s (s, increasing, (samples,)) or are derived from rate_hz. Instead of arrays, probe can be the URI of
a recording or simulation, or a list of URIs: "replay:press.csv", "replay:session.xdf", "sim:taps?depth_mm=1". Without
either, the scene's own probe runs. sinks are URIs that also get the spikes ("nwb:run.nwb").

Releases the GIL; Ctrl-C ends the run. Raises Error with the program's message on failure.)";

/// The URIs of the argument `probe`.
std::vector<std::string> uris_of(const py::object& text_or_list) {
  if (text_or_list.is_none()) return {};
  try {
    if (py::isinstance<py::str>(text_or_list)) return {text_or_list.cast<std::string>()};
    return text_or_list.cast<std::vector<std::string>>();
  } catch (const py::cast_error&) {
    throw Error("probe must be a URI or a list of URIs, but is " +
                py::repr(text_or_list).cast<std::string>());
  }
}

/// A dict from names of keys to values.
SceneOverrides overrides_of(const py::object& given) {
  if (given.is_none()) return {};
  if (!py::isinstance<py::dict>(given))
    throw Error("overrides must be a dict of keys of the scene");
  SceneOverrides overrides;
  for (const auto& [key, value] : given.cast<py::dict>()) {
    overrides.emplace_back(py::str(key).cast<std::string>(), value_text(value));
  }
  return overrides;
}

RunObject run(SceneObject& scene, py::object depth_mm, py::object force_N, py::object x_mm,
              py::object y_mm, py::object time_s, std::optional<double> rate_hz,
              const py::object& probe, std::optional<std::uint64_t> seed,
              std::optional<double> duration_s, const std::vector<std::string>& sinks,
              bool overwrite) {
  return run_scene(scene.scene(),
                   {.press = {.depth_mm = std::move(depth_mm),
                              .force_N = std::move(force_N),
                              .x_mm = std::move(x_mm),
                              .y_mm = std::move(y_mm),
                              .time_s = std::move(time_s),
                              .rate_hz = rate_hz},
                    .probes = uris_of(probe),
                    .seed = seed,
                    .duration_s = duration_s,
                    .sinks = sinks,
                    .overwrite = overwrite},
                   scene.models());
}

void add_scene_class(py::module_& module) {
  py::class_<SceneObject>(module, "Scene", R"(A preset ("paper", "finger", …) or a scene file.

Read and set keys by name, scene["skin.radius_mm"], or as attributes, scene.skin.radius_mm. For a repeated
table: scene["probe[1].x_mm"]. Scene.keys() lists all keys; `merkel scene --keys` explains
them. An invalid value raises Error and leaves the scene unchanged. overrides sets several keys at once:
Scene("finger", overrides={"skin.radius_mm": 9}).)")
      .def(py::init([](const std::filesystem::path& name_or_file, const py::object& overrides) {
             SceneObject scene = SceneObject::named(name_or_file.string());
             scene.override_keys(overrides_of(overrides));
             return scene;
           }),
           py::arg("name_or_file") = "paper", py::kw_only(), py::arg("overrides") = py::none())
      .def_static(
          "from_text",
          [](const std::string& text, const py::object& overrides) {
            SceneObject scene = SceneObject::of_text(text);
            scene.override_keys(overrides_of(overrides));
            return scene;
          },
          py::arg("text"), py::kw_only(), py::arg("overrides") = py::none(),
          "Parses the text of a scene file (TOML). Errors name the line.")
      .def_property_readonly(
          "text", [](const SceneObject& scene) { return scene_text(scene.scene()); },
          "The scene as a complete, commented scene file.")
      .def("keys", &SceneObject::keys, "All names of keys, in the order of a scene file.")
      .def("__getattr__", &table_named)
      .def("__getitem__", &SceneObject::get, py::arg("key"))
      .def("__setitem__", &SceneObject::set, py::arg("key"), py::arg("value"))
      .def_property_readonly(
          "afferents",
          [](const SceneObject& scene) { return array_of(afferent_rows(scene.scene().model)); },
          "(afferents,) of neuron, patch, x_mm, y_mm, field_radius_mm and receptors.")
      .def_property(
          "keep_model", [](SceneObject& scene) { return scene.models() != nullptr; },
          &SceneObject::keep_model,
          "True: a run keeps its model in memory for the next run of the unchanged scene, which starts sooner. "
          "Default: False.")
      .def_property_readonly(
          "probes", [](const SceneObject& scene) { return scene.scene().probes.size(); },
          "Number of probes.")
      .def_property_readonly(
          "uris",
          [](const SceneObject& scene) {
            std::vector<std::string> uris;
            for (std::size_t i = 0; i < scene.scene().probes.size(); ++i) {
              uris.push_back(scene.scene().uri_of(i));
            }
            return uris;
          },
          "The URI of each probe, with the channels that it takes from its device after #.")
      .def("run", &run, py::kw_only(), py::arg("depth_mm") = py::none(),
           py::arg("force_N") = py::none(), py::arg("x_mm") = py::none(),
           py::arg("y_mm") = py::none(), py::arg("time_s") = py::none(),
           py::arg("rate_hz") = py::none(), py::arg("probe") = py::none(),
           py::arg("seed") = py::none(), py::arg("duration_s") = py::none(),
           py::arg("sinks") = std::vector<std::string>(), py::arg("overwrite") = false, kRunHelp)
      .def(
          "stream",
          [](const SceneObject& scene, double max_gap_s) {
            return std::make_unique<StreamObject>(scene.scene(), max_gap_s);
          },
          py::kw_only(), py::arg("max_gap_s") = StreamObject::kMaxGap_s,
          "Builds the model and returns a Stream to push samples into. A sample more than max_gap_s "
          "seconds after its probe's last one raises Error.")
      .def(
          "_drop_sinks", [](SceneObject& scene) { return drop_sinks(scene.scene()); },
          "drop_sinks() of tools/batch/batch_job.hpp.")
      .def(
          "_identity", [](const SceneObject& scene) { return scene_identity(scene.scene()); },
          "scene_identity() of tools/batch/batch_identity.hpp.")
      .def(
          "_override",
          [](SceneObject& scene, const py::object& overrides) {
            scene.override_keys(overrides_of(overrides));
          },
          "Sets keys as the argument overrides of Scene() does.")
      .def("__copy__", [](const SceneObject& scene) { return scene; })
      .def(py::pickle(
          [](const SceneObject& scene) {
            return py::make_tuple(scene_text(scene.scene()), heights_of(scene.scene()));
          },
          [](const py::tuple& state) {
            if (state.size() != 2)
              throw Error("this pickled Scene is of another version of merkel");
            return SceneObject(or_throw(parse_scene(state[0].cast<std::string>(), "scene",
                                                    state[1].cast<std::vector<std::string>>())));
          }))
      .def("__deepcopy__", [](const SceneObject& scene, const py::dict&) { return scene; })
      .def("__repr__", [](const SceneObject& scene) {
        const std::string& file = scene.scene().file;
        return "<Scene " + (file.empty() ? scene.scene().preset : file) + ">";
      });
}

}  // namespace

PYBIND11_MODULE(_merkel, module) {
  merkel::python::end_runs_at_exit();
  module.doc() = "Tactile spikes from a haptic probe. See help(merkel).";
  module.attr("__version__") = MERKEL_VERSION;
  module.attr("_git_hash") = kGitHash;
  py::register_exception<Error>(module, "Error", PyExc_RuntimeError);
  register_rows();
  add_tables(module);
  module.def(
      "_batch_names",
      [](const std::string& scene, const std::string& identity, const std::string& probe,
         std::optional<std::uint64_t> seed, std::optional<double> duration_s,
         const SceneOverrides& overrides, const std::string& kept, const std::string& name,
         const std::string& more, const std::string& extension) {
        BatchJob job{.scene = scene,
                     .name = name,
                     .probe = probe,
                     .seed = seed,
                     .duration_s = duration_s,
                     .overrides = overrides};
        job.id = batch_id(job, identity, kept, more);
        if (!extension.empty()) job.file = or_throw(kept_file(job, extension));
        return std::tuple(job.id, command_of(job), job.file);
      },
      "batch_id(), command_of() and kept_file() of tools/batch/batch_identity.hpp.");
  module.def("_numbers", &numbers_of, "numbers_of() of array_source.hpp.");
  module.def("_value_text", &value_text, "value_text() of scene_object.hpp.");
  module.def("_split_fragment", &split_fragment, "split_fragment() of channel_selection.hpp.");
  module.def(
      "_session_jobs",
      [](const std::vector<std::string>& paths) {
        TextTable table = or_throw(session_jobs(paths));
        return std::pair(std::move(table.columns), std::move(table.rows));
      },
      "session_jobs() of tools/batch/batch_job.hpp.");
  add_scene_class(module);
  add_run(module);
  add_output(module);
  add_stream(module);
  add_bridge(module);
  add_session(module);
  add_fit(module);
  module.def(
      "_main",
      [](const std::vector<std::string>& arguments, const std::string& path) {
        own_program() = path;
        std::vector<std::string> words = arguments;
        std::vector<char*> argv;
        for (std::string& word : words) argv.push_back(word.data());
        argv.push_back(nullptr);
        std::signal(SIGINT, SIG_DFL);  // the program's own, not that of the interpreter
        const py::gil_scoped_release released;
        return run_merkel(static_cast<int>(words.size()), argv.data());
      },
      "The program merkel, which is started again by a path. The first argument is its name; returns "
      "the exit code");
  module.def(
      "presets", [] { return preset_names(); }, "Names of the presets.");
}

}  // namespace merkel::python
