#include "tools/python/src/array_source.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <string_view>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/sample_limits.hpp"
#include "tools/python/src/records.hpp"

namespace merkel::python {
namespace {

namespace py = pybind11;
using std::chrono::nanoseconds;
constexpr double kFastest_Hz = 1e9;

/// Values by sample and probe; of a scalar or of one column, the same for every sample or probe.
class Channel {
 public:
  Channel(const char* name, const py::object& values) : name_(name) {
    if (values.is_none()) return;
    values_ = numbers_of(name_, values);
  }
  [[nodiscard]] bool given() const { return values_.has_value(); }
  /// Nothing for a scalar.
  [[nodiscard]] std::optional<std::size_t> samples() const {
    if (!values_ || values_->ndim() == 0) return std::nullopt;
    return static_cast<std::size_t>(values_->shape(0));
  }
  void check(std::size_t samples, std::size_t probes) const {
    if (const auto own = this->samples(); own && *own != samples) {
      throw Error(name_ + " has " + std::to_string(*own) + " samples, the others have " +
                  std::to_string(samples));
    }
    if (values_ && values_->ndim() == 2 && static_cast<std::size_t>(values_->shape(1)) != probes) {
      throw Error(name_ + " has " + std::to_string(values_->shape(1)) +
                  " columns, and the scene has " + std::to_string(probes) + " probes");
    }
    if (values_ && values_->ndim() < 2 && probes > 1) {
      throw Error(name_ + " has no column for each of the scene's " + std::to_string(probes) +
                  " probes: give an array of (samples, probes)");
    }
  }
  /// \throws Error where the value cannot be
  [[nodiscard]] double at(std::size_t sample, std::size_t probe, double limit) const {
    const double* const all = values_->data();
    const std::size_t columns =
        values_->ndim() == 2 ? static_cast<std::size_t>(values_->shape(1)) : 1;
    const double value = values_->ndim() == 0 ? all[0] : all[sample * columns + probe];
    if (!plausible(value, limit)) {
      throw Error(name_ + "[" + std::to_string(sample) + "] is " + shortest_decimal(value) +
                  (std::isfinite(value)
                       ? ", beyond ±" + shortest_decimal(limit) + ": check its unit"
                       : ", not finite: correct or remove this sample"));
    }
    return value;
  }

 private:
  std::string name_;
  std::optional<Doubles> values_;
};

std::vector<nanoseconds> times_of(const Channel& time_s, std::optional<double> rate_hz,
                                  std::size_t count) {
  if (time_s.given() == rate_hz.has_value()) {
    throw Error(rate_hz ? "pass either time_s or rate_hz, not both"
                        : "the times are missing: pass rate_hz, or time_s for each sample");
  }
  if (rate_hz && !(*rate_hz > 0.0 && *rate_hz <= kFastest_Hz)) {
    throw Error("rate_hz must be positive and at most 1e9, but is " + shortest_decimal(*rate_hz));
  }
  if (rate_hz && static_cast<double>(count - 1) / *rate_hz > kMax_s) {
    throw Error("at rate_hz = " + shortest_decimal(*rate_hz) + ", the " + std::to_string(count) +
                " samples take more than 4e9 s: check its unit");
  }
  std::vector<nanoseconds> times(count);
  for (std::size_t i = 0; i < count; ++i) {
    times[i] = rate_hz ? nanoseconds{std::llround(static_cast<double>(i) * 1e9 / *rate_hz)}
                       : units::nanoseconds_from_s(time_s.at(i, 0, kMax_s));
    if (i > 0 && times[i] <= times[i - 1]) {
      throw Error(
          "time_s[" + std::to_string(i) + "] is " + shortest_decimal(units::s_from(times[i])) +
          ", not later than the previous sample (resolution: 1 ns): sort the samples by time");
    }
  }
  return times;
}

}  // namespace

Expected<std::size_t, SetupError> ArraySource::read(Readings& readings, std::size_t most) {
  const std::size_t count = std::min(most, samples_.size() - next_);
  for (std::size_t i = 0; i < count; ++i) readings.add_sample(samples_[next_++]);
  return count;
}

Doubles numbers_of(const std::string& name, const py::object& values) {
  if (py::hasattr(values, "mask") &&
      py::module_::import("numpy.ma").attr("is_masked")(values).cast<bool>()) {
    throw Error(name + " has masked values: remove these samples");
  }
  // Dates and durations would be counts of their own units, complex numbers and records lose parts.
  const py::array any = py::array::ensure(values);
  const std::string wanted =
      name + " must be an array of numbers: (samples,), or (samples, probes)";
  if (any && any.ndim() > 2) {
    throw Error(wanted + ", but has " + std::to_string(any.ndim()) + " dimensions");
  }
  if (any && std::string_view("MmcV").find(any.dtype().kind()) == std::string_view::npos) {
    if (auto numbers = Doubles::ensure(any)) return numbers;
  }
  throw Error(wanted +
              (any ? ", but has the dtype " + py::str(any.dtype()).cast<std::string>() : ""));
}

double mN_of(double force_N) { return *parse_number(shortest_decimal(force_N), 3); }

bool PressArrays::given() const {
  return rate_hz || !depth_mm.is_none() || !force_N.is_none() || !x_mm.is_none() ||
         !y_mm.is_none() || !time_s.is_none();
}

std::vector<std::vector<ProbeSample>> PressArrays::samples(std::size_t probes) const {
  const Channel depth("depth_mm", depth_mm);
  const Channel force("force_N", force_N);
  const Channel x("x_mm", x_mm);
  const Channel y("y_mm", y_mm);
  const Channel time("time_s", time_s);
  const auto count = depth.samples() ? depth.samples() : force.samples();
  if (!count || *count == 0)
    throw Error("there are no samples: pass depth_mm or force_N as arrays");
  for (const Channel* channel : {&depth, &force}) channel->check(*count, probes);
  for (const Channel* channel : {&x, &y}) {
    if (channel->samples() || probes == 1) channel->check(*count, probes);
  }
  time.check(*count, 1);
  const std::vector<nanoseconds> times = times_of(time, rate_hz, *count);
  const std::uint32_t channels = (depth.given() ? std::uint32_t{ProbeSample::kDepth} : 0U) |
                                 (force.given() ? std::uint32_t{ProbeSample::kForce} : 0U) |
                                 (x.given() ? std::uint32_t{ProbeSample::kX} : 0U) |
                                 (y.given() ? std::uint32_t{ProbeSample::kY} : 0U);
  std::vector<std::vector<ProbeSample>> all(probes, std::vector<ProbeSample>(*count));
  for (std::size_t probe = 0; probe < probes; ++probe) {
    for (std::size_t i = 0; i < *count; ++i) {
      ProbeSample& sample = all[probe][i];
      sample.time = sample.arrival = times[i];
      sample.sequence = static_cast<std::uint32_t>(i);
      sample.channels = channels;
      sample.valid_for = SampleSource::kNotStated;
      if (depth.given()) sample.depth_mm = depth.at(i, probe, SampleLimits::kDepth_mm);
      if (force.given()) {
        sample.force_mN = mN_of(force.at(i, probe, units::N_from_mN(SampleLimits::kForce_mN)));
      }
      if (x.given()) sample.x_mm = x.at(i, probe, SampleLimits::kPosition_mm);
      if (y.given()) sample.y_mm = y.at(i, probe, SampleLimits::kPosition_mm);
    }
  }
  return all;
}

}  // namespace merkel::python
