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

double channel(const ProbeSample& sample, ProbeSample::Channel bit, double value) {
  return sample.has(bit) ? value : kMissing;
}

}  // namespace

void register_rows() {
  PYBIND11_NUMPY_DTYPE(SpikeRow, time_s, neuron, patch, flags);
  PYBIND11_NUMPY_DTYPE_EX(AfferentRow, number, "neuron", patch, "patch", x_mm, "x_mm", y_mm, "y_mm",
                          field_radius_mm, "field_radius_mm", receptors, "receptors");
  PYBIND11_NUMPY_DTYPE(SampleRow, time_s, arrival_s, probe, depth_mm, force_N, x_mm, y_mm);
  PYBIND11_NUMPY_DTYPE(TickRow, time_s, probe, depth_mm, force_N, x_mm, y_mm, state, late,
                       latency_us);
  PYBIND11_NUMPY_DTYPE(CommandRow, time_s, electrode, kind, stop, amplitude_uA, frequency_Hz,
                       heartbeat);
  PYBIND11_NUMPY_DTYPE(EventRow, time_s, length_s, subject, kind);
}

SpikeRow row_of(const SpikeEvent& spike, std::chrono::nanoseconds zero) {
  return {.time_s = units::s_from(spike.time - zero),
          .neuron = spike.neuron,
          .patch = spike.patch,
          .flags = spike.flags};
}

SampleRow row_of(std::uint32_t probe, const ProbeSample& sample, std::chrono::nanoseconds zero) {
  return {.time_s = units::s_from(sample.time - zero),
          .arrival_s = units::s_from(sample.arrival - zero),
          .probe = probe,
          .depth_mm = channel(sample, ProbeSample::kDepth, sample.depth_mm),
          .force_N = channel(sample, ProbeSample::kForce, units::N_from_mN(sample.force_mN)),
          .x_mm = channel(sample, ProbeSample::kX, sample.x_mm),
          .y_mm = channel(sample, ProbeSample::kY, sample.y_mm)};
}

TickRow row_of(const TickRecord& tick, std::chrono::nanoseconds zero) {
  return {.time_s = units::s_from(tick.time - zero),
          .probe = tick.probe,
          .depth_mm = tick.contact.depth_mm,
          .force_N = units::N_from_mN(tick.contact.force_mN),
          .x_mm = tick.contact.x_mm,
          .y_mm = tick.contact.y_mm,
          .state = static_cast<std::uint8_t>(tick.state),
          .late = tick.late,
          .latency_us = static_cast<double>(tick.latency.count()) * 1e-3};
}

CommandRow row_of(const StimulationCommand& command, std::chrono::nanoseconds zero) {
  return {.time_s = units::s_from(command.time - zero),
          .electrode = command.electrode,
          .kind = static_cast<std::uint8_t>(command.kind),
          .stop = static_cast<std::uint8_t>(command.stop),
          .amplitude_uA = command.amplitude_uA,
          .frequency_Hz = command.frequency_Hz,
          .heartbeat = command.heartbeat};
}

EventRow row_of(const LoopEvent& event, std::chrono::nanoseconds zero) {
  return {.time_s = units::s_from(event.time - zero),
          .length_s = units::s_from(event.length),
          .subject = event.subject,
          .kind = static_cast<std::uint8_t>(event.kind)};
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
  return pybind11::reinterpret_steal<pybind11::tuple>(output_type(spikes, stimulation).release());
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
