#include "tools/python/src/records.hpp"

#include <limits>
#include <string_view>
#include <utility>

#include "core/units.hpp"

namespace merkel::python {
namespace {

/// The class Output. Never released: the interpreter may be gone when static objects are destroyed.
pybind11::handle output_type;

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

}  // namespace

void register_rows() {
  PYBIND11_NUMPY_DTYPE_EX(AfferentRow, number, "neuron", patch, "patch", x_mm, "x_mm", y_mm, "y_mm",
                          field_radius_mm, "field_radius_mm", receptors, "receptors");
  register_row<SpikeEvent>();
  register_row<DeliveredSample>();
  register_row<TickRecord>();
  register_row<LoopEvent>();
  register_row<SyncEdge>();
  register_row<StimulationCommand>();
}

SampleRow row_of_sample(const DeliveredSample& item, std::chrono::nanoseconds zero) {
  DeliveredSample shown = item;
  ProbeSample& sample = shown.sample;
  if (!sample.has(ProbeSample::kDepth)) sample.depth_mm = kMissing;
  if (!sample.has(ProbeSample::kForce)) sample.force_mN = kMissing;
  if (!sample.has(ProbeSample::kX)) sample.x_mm = kMissing;
  if (!sample.has(ProbeSample::kY)) sample.y_mm = kMissing;
  return row_of(shown, zero);
}

std::vector<AfferentRow> afferent_rows(const ModelParameters& model) {
  auto rows = merkel::afferents_of(model);
  if (!rows) throw Error(rows.error().key + " " + rows.error().reason);
  return std::move(*rows);
}

void add_output(pybind11::module_& module) {
  pybind11::object type =
      pybind11::module_::import("collections")
          .attr("namedtuple")("Output", pybind11::make_tuple("spikes", "stimulation"),
                              pybind11::arg("module") = "merkel");
  type.attr("__doc__") =
      R"(Spikes and stimulation commands since the last call: spikes, stimulation = stream.push(...).

spikes is (spikes,) of time_s, neuron, patch and flags; stimulation is (commands,) as Run.stimulation, empty
where the scene has no electrodes.)";
  module.attr("Output") = type;
  output_type = type.release();
}

pybind11::tuple output_of(const pybind11::array_t<SpikeRow>& spikes,
                          const pybind11::array_t<CommandRow>& stimulation) {
  // Not by Output's own __new__, which is Python: at the end of the interpreter, a daemon thread in
  // Python code is unwound, and with it the C++ that called it.
  auto* const type = reinterpret_cast<PyTypeObject*>(output_type.ptr());
  const auto values = pybind11::make_tuple(pybind11::make_tuple(spikes, stimulation));
  auto made = pybind11::reinterpret_steal<pybind11::tuple>(
      PyTuple_Type.tp_new(type, values.ptr(), nullptr));
  if (!made) throw pybind11::error_already_set();
  return made;
}

std::string in_python(std::string sentence) {
  static constexpr std::pair<std::string_view, std::string_view> kNames[] = {
      {"--overwrite", "overwrite=True"}, {"--allow-remote", "allow_remote=True"}};
  for (const auto& [option, argument] : kNames) {
    const auto place = sentence.find(option);
    if (place != std::string::npos) sentence.replace(place, option.size(), argument);
  }
  return sentence;
}

}  // namespace merkel::python
