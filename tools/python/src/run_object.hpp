#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "realtime/pipeline.hpp"
#include "tools/python/src/array_source.hpp"
#include "tools/python/src/initialised.hpp"
#include "tools/python/src/records.hpp"
#include "tools/scene/prepared_run.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel::python {

/// The Python class Run: the result of a batch run.
struct RunObject {
  std::vector<SpikeRow> spikes;
  std::vector<CommandRow> stimulation;
  std::vector<AfferentRow> afferents;
  double start_s = 0.0;
  double duration_s = 0.0;
  std::map<std::string, std::uint64_t> counters;
  std::vector<std::string> notices;
  std::string verdict;
  std::string spike_hash;  ///< SpikeHash of the spikes

  /// Spike times of one neuron, from 1. \throws Error where there is no such neuron
  [[nodiscard]] pybind11::array_t<double> times(std::uint32_t neuron) const;
  /// Rates in Hz: (bins, afferents).
  [[nodiscard]] pybind11::array_t<double> rate(double bin_s) const;
  /// Mean rate of an afferent in each bin, in Hz: (bins,).
  [[nodiscard]] pybind11::array_t<double> psth(double bin_s) const;

 private:
  [[nodiscard]] std::size_t bins(double bin_s) const;
  [[nodiscard]] std::size_t bin_of(const SpikeRow& spike, double bin_s) const;
};

struct RunOptions {
  PressArrays press;
  std::vector<std::string> probes;
  std::optional<std::uint64_t> seed;
  std::optional<double> duration_s;
  std::vector<std::string> sinks;
  bool overwrite = false;
};

/// Runs a scene as `merkel run --fast` does, without the GIL. \throws Error
/// \param models  may hold the model, and keeps it; null: none
[[nodiscard]] RunObject run_scene(Scene scene, const RunOptions& options,
                                  ModelCache* models = nullptr);

/// The argument duration_s of a run. \throws Error where it is not a positive time
[[nodiscard]] std::optional<std::chrono::nanoseconds> duration_of(std::optional<double> duration_s);

/// The counters of a run, by name.
[[nodiscard]] std::map<std::string, std::uint64_t> counters_of(const RunCounters& counters);

/// Adds Run to the module.
void add_run(pybind11::module_& module);

}  // namespace merkel::python

template <>
struct pybind11::detail::type_caster<merkel::python::RunObject>
    : merkel::python::Initialised<merkel::python::RunObject> {};
