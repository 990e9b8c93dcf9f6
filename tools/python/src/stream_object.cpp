#include "tools/python/src/stream_object.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <pybind11/stl.h>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "tools/python/src/array_source.hpp"
#include "tools/python/src/interpreter_exit.hpp"

namespace merkel::python {
namespace {

namespace py = pybind11;

constexpr std::chrono::milliseconds kSignalsEvery{50};
constexpr std::uint32_t kPresses = ProbeSample::kDepth | ProbeSample::kForce;

}  // namespace

/// One thread at a time: without the GIL nothing else keeps a second one out.
class StreamObject::Use {
 public:
  explicit Use(std::atomic<bool>& used) : used_(used) {
    if (used_.exchange(true)) {
      throw Error("the stream is in use in another thread: use a separate stream in each thread");
    }
  }
  Use(const Use&) = delete;
  Use& operator=(const Use&) = delete;
  ~Use() { used_.store(false); }

 private:
  std::atomic<bool>& used_;
};

StreamObject::StreamObject(Scene scene, double max_gap_s)
    : scene_(std::move(scene)),
      max_gap_s_(max_gap_s),
      last_s_(scene_.probes.size()),
      started_(scene_.probes.size(), false) {
  if (!(max_gap_s_ > 0.0 && max_gap_s_ <= 2.0 * kMax_s)) {
    throw Error("max_gap_s must be a positive number of seconds up to 8e9, but is " +
                shortest_decimal(max_gap_s_));
  }
  for (const Scene::ProbeSettings& probe : scene_.probes) {
    channels_.push_back(probe.control == Indenter::Control::kForce
                            ? std::uint32_t{ProbeSample::kForce}
                            : std::uint32_t{ProbeSample::kDepth});
  }
  build();
}

void StreamObject::build() {
  const GilRelease no_gil;
  std::vector<GivenDrive> drives = stream_ ? stream_->drives() : std::vector<GivenDrive>();
  stream_.emplace(or_throw(SampleStream::create(scene_, channels_)));
  stream_->take_drives(std::move(drives));
  stream_->set_interrupt([this] { return signalled(); });
}

/// The first sample of a probe shows what it measures. The model is built again where that changes
/// the reading that drives it.
void StreamObject::announce(std::size_t probe, std::uint32_t channels) {
  if (probe >= channels_.size()) {
    throw Error("there is no probe " + std::to_string(probe) + ": the scene has " +
                std::to_string(channels_.size()) + ", counted from 0");
  }
  if ((channels & kPresses) == 0U) {
    throw Error("the sample has neither depth nor force: pass depth_mm or force_N");
  }
  if (started_[probe]) {
    if (((channels ^ channels_[probe]) & kPresses) != 0U) {
      throw Error("all samples of a probe must have the same channels (depth_mm, force_N or both)");
    }
    return;
  }
  if (((channels ^ channels_[probe]) & kPresses) == 0U) {
    started_[probe] = true;
    return;
  }
  if (std::find(started_.begin(), started_.end(), true) != started_.end()) {
    throw Error(
        "all probes of a stream must measure the same channels (depth_mm, force_N or both): set probe.control "
        "in the scene");
  }
  const std::vector<std::uint32_t> before = channels_;
  std::fill(channels_.begin(), channels_.end(), channels & kPresses);
  try {
    build();
  } catch (const Error&) {
    channels_ = before;
    throw;
  }
  started_[probe] = true;
}

py::tuple StreamObject::output(std::span<const SpikeEvent> spikes) {
  const auto array = [](const auto& events, auto& rows, const auto& none) {
    if (events.empty()) return none;
    rows.clear();
    for (const auto& each : events) rows.push_back(row_of(each, std::chrono::nanoseconds{0}));
    return array_of(rows);
  };
  return output_of(array(spikes, rows_, no_spikes_),
                   array(stream_->commands(), command_rows_, no_commands_));
}

template <class Call>
auto StreamObject::interruptible(const Call& call) {
  asked_ = std::chrono::steady_clock::now();
  const auto result = [&] {
    const GilRelease no_gil;
    return call();
  }();
  if (std::exchange(interrupted_, false)) throw py::error_already_set();
  return result;
}

py::tuple StreamObject::push(double time_s, const Reading& reading, std::size_t probe) {
  const Use use(used_);
  if (!(std::fabs(time_s) <= kMax_s)) {
    throw Error("time_s must be a finite number of seconds within ±4e9");
  }
  ProbeSample sample;
  sample.time = sample.arrival = units::nanoseconds_from_s(time_s);
  const auto take = [&](const std::optional<double>& value, ProbeSample::Channel bit, double& to) {
    if (!value) return;
    to = *value;
    sample.channels |= bit;
  };
  take(reading.depth_mm, ProbeSample::kDepth, sample.depth_mm);
  take(reading.force_N, ProbeSample::kForce, sample.force_mN);
  take(reading.x_mm, ProbeSample::kX, sample.x_mm);
  take(reading.y_mm, ProbeSample::kY, sample.y_mm);
  if (reading.force_N && std::isfinite(*reading.force_N)) sample.force_mN = mN_of(*reading.force_N);
  announce(probe, sample.channels);
  check_gap(time_s, probe);
  const auto spikes = interruptible([&] {
    auto pushed = or_throw(stream_->push(probe, sample));
    last_s_[probe] = time_s;
    return pushed;
  });
  return output(spikes);
}

void StreamObject::check_gap(double time_s, std::size_t probe) const {
  const double gap_s = time_s - last_s_[probe].value_or(time_s);
  if (gap_s <= max_gap_s_) return;
  throw Error("the sample of " + shortest_decimal(time_s) + " s comes " + shortest_decimal(gap_s) +
              " s after the last one of its probe, which is more than max_gap_s = " +
              shortest_decimal(max_gap_s_) +
              ": check that time_s is in seconds, or allow the gap with scene.stream(max_gap_s=" +
              shortest_decimal(std::ceil(gap_s)) + ")");
}

bool StreamObject::signalled() {
  const auto now = std::chrono::steady_clock::now();
  if (now - asked_ < kSignalsEvery) return false;
  asked_ = now;
  const GilAcquire gil;
  interrupted_ = PyErr_CheckSignals() != 0;
  return interrupted_;
}

py::tuple StreamObject::finish() {
  const Use use(used_);
  return output(interruptible([&] { return stream_->finish(); }));
}

void StreamObject::set_drive(const std::string& electrode, double amplitude,
                             std::optional<double> frequency) {
  const Use use(used_);
  or_throw(stream_->set_drive(electrode, amplitude, frequency.value_or(amplitude)));
}

std::optional<double> StreamObject::time_s() const {
  const auto time = stream_->time();
  return time ? std::optional(units::s_from(*time)) : std::nullopt;
}

void add_stream(py::module_& module) {
  py::class_<StreamObject>(module, "Stream", R"(The model itself, a sample at a time.

The spikes are those of Scene.run() of the same samples, bit for bit. Between two samples the press is
their linear interpolation, so a tick is simulated once a sample beyond its end was pushed. Without the
GIL while it simulates; one thread at a time.)")
      .def(
          "push",
          [](StreamObject& stream, double time_s, std::optional<double> depth_mm,
             std::optional<double> force_N, std::optional<double> x_mm, std::optional<double> y_mm,
             std::size_t probe) {
            return stream.push(time_s, {depth_mm, force_N, x_mm, y_mm}, probe);
          },
          py::arg("time_s"), py::kw_only(), py::arg("depth_mm") = py::none(),
          py::arg("force_N") = py::none(), py::arg("x_mm") = py::none(),
          py::arg("y_mm") = py::none(), py::arg("probe") = 0,
          R"(Takes a sample and returns the Output: the new spikes and stimulation commands.

time_s is in s and increases from sample to sample, by at most max_gap_s. Give depth_mm (mm), force_N (N) or both; x_mm and
y_mm if the probe moves over the skin. An invalid sample raises Error and is ignored.)")
      .def("finish", &StreamObject::finish,
           "Simulates up to the last sample and returns the Output. No sample may follow.")
      .def("set_drive", &StreamObject::set_drive, py::arg("electrode"), py::arg("amplitude"),
           py::arg("frequency") = py::none(), kSetDriveText)
      .def_property_readonly("time_s", &StreamObject::time_s,
                             "The end of the last tick in s; None before the first tick.");
}

}  // namespace merkel::python
