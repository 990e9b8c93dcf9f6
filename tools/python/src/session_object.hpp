#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>

#include "core/records/taxel_block.hpp"
#include "core/records/tick_record.hpp"
#include "drivers/run_control.hpp"
#include "drivers/sink.hpp"
#include "tools/python/src/initialised.hpp"
#include "tools/python/src/records.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel::python {

/// The Python class Session: a recorded session in memory. Times count from the start of the run.
struct SessionObject {
  std::vector<SpikeRow> spikes;
  std::vector<SampleRow> samples;
  /// Further columns of the samples, by name: NaN where a probe has none.
  std::vector<std::pair<std::string, std::vector<double>>> extra;
  std::vector<TickRow> ticks;
  /// Pressures of a tactile array, by probe: a row per tick, kPa.
  struct Taxels {
    std::size_t count = 0;
    std::vector<float> now;
    std::vector<float> rows = {};
  };
  std::map<std::uint32_t, Taxels> taxels;
  std::vector<EventRow> events;
  std::vector<EdgeRow> sync;
  std::vector<CommandRow> stimulation;
  std::vector<AfferentRow> afferents;
  std::vector<std::pair<double, std::string>> marks;
  std::vector<std::pair<std::string, std::string>> facts;
  std::optional<Scene> scene;  ///< nothing of samples recorded without a simulation
  RunOrigin origin;
  bool complete = false;  ///< the recording was ended properly

  /// \throws Error
  [[nodiscard]] static SessionObject load(const std::string& path);

 private:
  void add_taxels(const TickRecord& tick, std::deque<TaxelBlock>& blocks);
};

/// Adds Session and load() to the module.
void add_session(pybind11::module_& module);

}  // namespace merkel::python

template <>
struct pybind11::detail::type_caster<merkel::python::SessionObject>
    : merkel::python::Initialised<merkel::python::SessionObject> {};
