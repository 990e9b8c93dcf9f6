#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "core/expected.hpp"
#include "core/records/loop_event.hpp"
#include "core/records/probe_sample.hpp"
#include "core/records/spike_event.hpp"
#include "core/records/stimulation_command.hpp"
#include "core/records/tick_record.hpp"
#include "core/scene/model_parameters.hpp"
#include "drivers/sinks/afferent_table.hpp"

namespace merkel::python {

/// Rows of the structured arrays that Python sees. Times are in s; neurons count from 1 through all
/// patches, probes and patches from 0, as in every file that merkel writes.
struct SpikeRow {
  double time_s;
  std::uint32_t neuron;
  std::uint16_t patch;
  std::uint16_t flags;
};
struct SampleRow {
  double time_s;
  double arrival_s;
  std::uint32_t probe;
  double depth_mm;
  double force_N;
  double x_mm;
  double y_mm;
};
struct TickRow {
  double time_s;
  std::uint32_t probe;
  double depth_mm;
  double force_N;
  double x_mm;
  double y_mm;
  std::uint8_t state;
  std::uint16_t late;
  double latency_us;
};
struct EventRow {
  double time_s;
  double length_s;
  std::uint32_t subject;
  std::uint8_t kind;
};

struct CommandRow {
  double time_s;
  std::uint16_t electrode;
  std::uint8_t kind;
  std::uint8_t stop;
  double amplitude_uA;
  double frequency_Hz;
  std::uint32_t heartbeat;
};

/// Makes the rows known to numpy. Call once, when the module is loaded.
void register_rows();

/// Rows with times counted from `zero`.
[[nodiscard]] SpikeRow row_of(const SpikeEvent& spike, std::chrono::nanoseconds zero);
[[nodiscard]] SampleRow row_of(std::uint32_t probe, const ProbeSample& sample,
                               std::chrono::nanoseconds zero);
[[nodiscard]] TickRow row_of(const TickRecord& tick, std::chrono::nanoseconds zero);
[[nodiscard]] CommandRow row_of(const StimulationCommand& command, std::chrono::nanoseconds zero);
[[nodiscard]] EventRow row_of(const LoopEvent& event, std::chrono::nanoseconds zero);

/// The afferents of a model, by number. \throws Error
[[nodiscard]] std::vector<AfferentRow> afferent_rows(const ModelParameters& model);

/// A new one-dimensional array with a copy of the rows.
template <class Row>
[[nodiscard]] pybind11::array_t<Row> array_of(const std::vector<Row>& rows) {
  return pybind11::array_t<Row>(static_cast<pybind11::ssize_t>(rows.size()), rows.data());
}

/// Spikes and stimulation commands since the last call, as the Python class Output: a named tuple
/// of both arrays. Needs the GIL. \throws pybind11::error_already_set
[[nodiscard]] pybind11::tuple output_of(const pybind11::array_t<SpikeRow>& spikes,
                                        const pybind11::array_t<CommandRow>& stimulation);

/// Adds the class Output to the module.
void add_output(pybind11::module_& module);

/// The module's exception: the sentence that the program would print.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A sentence of the program with its options as arguments of Python.
[[nodiscard]] std::string in_python(std::string sentence);

/// The value, or its error thrown as Error.
template <class T>
[[nodiscard]] T or_throw(Expected<T, SetupError>&& value) {
  if (!value) throw Error(in_python(value.error().sentence));
  return std::move(*value);
}
inline void or_throw(Expected<void, SetupError>&& value) {
  if (!value) throw Error(in_python(value.error().sentence));
}

}  // namespace merkel::python
