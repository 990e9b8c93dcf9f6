#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "tools/python/src/records.hpp"
#include "tools/scene/sample_stream.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel::python {

/// The Python class Stream: the model, one sample at a time.
class StreamObject {
 public:
  /// Builds the model, for samples of depth where the scene allows. \throws Error
  explicit StreamObject(Scene scene);

  struct Reading {
    std::optional<double> depth_mm;
    std::optional<double> force_N;
    std::optional<double> x_mm;
    std::optional<double> y_mm;
  };
  /// \throws Error
  [[nodiscard]] pybind11::tuple push(double time_s, const Reading& reading, std::size_t probe);
  [[nodiscard]] pybind11::tuple finish();
  [[nodiscard]] std::optional<double> time_s() const;

 private:
  class Use;
  void build();
  void announce(std::size_t probe, std::uint32_t channels);
  /// The new spikes and the commands that came with them.
  [[nodiscard]] pybind11::tuple output(std::span<const SpikeEvent> spikes);

  Scene scene_;
  std::vector<std::uint32_t> channels_;  ///< of each probe's first sample, or expected of it
  std::vector<bool> started_;            ///< a sample of the probe was taken
  std::optional<SampleStream> stream_;
  std::vector<SpikeRow> rows_;
  std::vector<CommandRow> command_rows_;
  pybind11::array_t<SpikeRow> no_spikes_{0};      ///< what a push without spikes returns
  pybind11::array_t<CommandRow> no_commands_{0};  ///< and one without commands
  std::atomic<bool> used_{false};
};

/// Adds Stream to the module.
void add_stream(pybind11::module_& module);

}  // namespace merkel::python
