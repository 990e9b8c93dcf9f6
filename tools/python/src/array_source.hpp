#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "drivers/sample_source.hpp"

namespace merkel::python {

/// The largest time; the difference of any two fits into 64-bit nanoseconds.
inline constexpr double kMax_s = 4e9;

/// The press of one probe in memory: a recording that was never a file.
class ArraySource final : public SampleSource {
 public:
  /// \param samples  in strictly increasing time, all with the same channels; at least one
  explicit ArraySource(std::vector<ProbeSample> samples) : samples_(std::move(samples)) {}

  [[nodiscard]] std::uint32_t channels() const noexcept override {
    return samples_.front().channels;
  }
  [[nodiscard]] Expected<std::size_t, SetupError> read(Readings& readings,
                                                       std::size_t most) override;

 private:
  std::vector<ProbeSample> samples_;
  std::size_t next_ = 0;
};

using Doubles = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

/// The argument `name`, an array of one or two dimensions. \throws Error where its values are no
/// real numbers
[[nodiscard]] Doubles numbers_of(const std::string& name, const pybind11::object& values);

/// A force in N as the mN that a trace with the same decimal gives.
[[nodiscard]] double mN_of(double force_N);

/// The press that Scene.run() was given, a list of samples for each probe. Arrays are (samples,)
/// or, of several probes, (samples, probes). \throws Error
struct PressArrays {
  pybind11::object depth_mm;
  pybind11::object force_N;
  pybind11::object x_mm;
  pybind11::object y_mm;
  pybind11::object time_s;
  std::optional<double> rate_hz;

  [[nodiscard]] bool given() const;
  [[nodiscard]] std::vector<std::vector<ProbeSample>> samples(std::size_t probes) const;
};

}  // namespace merkel::python
