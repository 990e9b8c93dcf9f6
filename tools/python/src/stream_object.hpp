#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "tools/python/src/initialised.hpp"
#include "tools/python/src/records.hpp"
#include "tools/scene/sample_stream.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel::python {

/// The Python class Stream: the model, one sample at a time.
class StreamObject {
 public:
  static constexpr double kMaxGap_s = 60.0;

  /// Builds the model, for samples of depth where the scene allows.
  /// \param max_gap_s  longest time between two samples of a probe \throws Error
  StreamObject(Scene scene, double max_gap_s);

  struct Reading {
    std::optional<double> depth_mm;
    std::optional<double> force_N;
    std::optional<double> x_mm;
    std::optional<double> y_mm;
  };
  /// \throws Error
  [[nodiscard]] pybind11::tuple push(double time_s, const Reading& reading, std::size_t probe);
  [[nodiscard]] pybind11::tuple finish();
  void set_drive(const std::string& electrode, double amplitude, std::optional<double> frequency);
  [[nodiscard]] std::optional<double> time_s() const;

 private:
  class Use;
  void build();
  void announce(std::size_t probe, std::uint32_t channels);
  /// The new spikes and the commands that came with them.
  [[nodiscard]] pybind11::tuple output(std::span<const SpikeEvent> spikes);

  void check_gap(double time_s, std::size_t probe) const;
  /// Asks Python whether Ctrl-C was pressed, a few times a second.
  [[nodiscard]] bool signalled();
  /// Calls the stream without the GIL, and lets Ctrl-C end it. \throws error_already_set
  template <class Call>
  auto interruptible(const Call& call);

  Scene scene_;
  double max_gap_s_;
  std::vector<std::optional<double>> last_s_;  ///< time of each probe's last sample
  std::vector<std::uint32_t> channels_;        ///< of each probe's first sample, or expected of it
  std::vector<bool> started_;                  ///< a sample of the probe was taken
  std::optional<SampleStream> stream_;
  std::vector<SpikeRow> rows_;
  std::vector<CommandRow> command_rows_;
  pybind11::array_t<SpikeRow> no_spikes_{0};      ///< what a push without spikes returns
  pybind11::array_t<CommandRow> no_commands_{0};  ///< and one without commands
  std::chrono::steady_clock::time_point asked_;   ///< when signalled() last asked
  bool interrupted_ = false;
  std::atomic<bool> used_{false};
};

/// Adds Stream to the module.
void add_stream(pybind11::module_& module);

}  // namespace merkel::python

template <>
struct pybind11::detail::type_caster<merkel::python::StreamObject>
    : merkel::python::Initialised<merkel::python::StreamObject> {};
