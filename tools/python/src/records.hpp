#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "core/expected.hpp"
#include "core/scene/model_parameters.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/sessions/afferent_table.hpp"
#include "tools/python/src/row.hpp"

namespace merkel::python {

using SpikeRow = Row<SpikeEvent>;
using SampleRow = Row<DeliveredSample>;
using TickRow = Row<TickRecord>;
using EventRow = Row<LoopEvent>;
using EdgeRow = Row<SyncEdge>;
using CommandRow = Row<StimulationCommand>;

/// Of Bridge.set_drive and Stream.set_drive.
inline constexpr const char* kSetDriveText =
    R"(An encoder of your own: the drive of an electrode with encoder = "own", and of its group.

From the next tick on, amplitude and frequency are those of the electrode's ranges, from 0 (off) to 1 (strongest); without
a frequency, it follows the amplitude. Give it again before watchdog_ms is over, or the electrode is off (stop no_drive).
All limits of the scene apply, and in a live run the gate.)";

/// Makes the rows known to numpy. Call once, when the module is loaded.
void register_rows();

/// A row of a sample; what the probe does not measure is NaN.
[[nodiscard]] SampleRow row_of_sample(const DeliveredSample& item, std::chrono::nanoseconds zero);

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

/// The module's exception: the sentence that the program would print, in UTF-8 whatever it quotes.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& sentence)
      : std::runtime_error(utf8_text(shortened(sentence))) {}
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
