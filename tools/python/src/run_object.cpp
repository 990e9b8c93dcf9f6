#include "tools/python/src/run_object.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <memory>
#include <string_view>
#include <type_traits>
#include <utility>

#include <pybind11/stl.h>

#include "core/parameters/parameter_error.hpp"
#include "core/records/spike_hash.hpp"
#include "core/units.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/probes/replay_probe.hpp"
#include "realtime/output/spike_callback.hpp"
#include "tools/python/src/interpreter_exit.hpp"
#include "tools/run/verdict.hpp"
#include "tools/scene/prepared_run.hpp"
#include "tools/scene/session_scene.hpp"
#include "tools/studies/plan/plan.hpp"

namespace merkel::python {
namespace {

namespace py = pybind11;

constexpr double kMaxBins = 1e8;
constexpr double kMinRun_s = 1e-6;

double time_s_of(const SpikeRow& spike) { return spike.get<double>("time_ns"); }
std::uint32_t neuron_of(const SpikeRow& spike) { return spike.get<std::uint32_t>("neuron"); }

std::vector<std::unique_ptr<Probe>> probes_of(const RunOptions& options, const Scene& scene) {
  std::vector<std::unique_ptr<Probe>> probes;
  if (!options.press.given()) return probes;
  for (auto& samples : options.press.samples(scene.probes.size())) {
    probes.push_back(or_throw(ReplayProbe::play(std::make_unique<ArraySource>(std::move(samples)),
                                                {.uri = "array:", .name = "arrays"})));
  }
  return probes;
}

}  // namespace

std::map<std::string, std::uint64_t> counters_of(const RunCounters& counters) {
  std::map<std::string, std::uint64_t> all;
  for (const auto& field : kRunCounterFields<>) {
    all.emplace(std::string(field.name), counters.*field.cell);
  }
  return all;
}

std::optional<std::chrono::nanoseconds> duration_of(std::optional<double> duration_s) {
  if (!duration_s) return std::nullopt;
  if (!(*duration_s >= kMinRun_s && *duration_s <= kMax_s)) {
    throw Error("duration_s must be a number of seconds from 1e-6 to 4e9, but is " +
                shortest_decimal(*duration_s));
  }
  return units::nanoseconds_from_s(*duration_s);
}

namespace {

/// Sets a flag at its end, also after an exception.
class Over {
 public:
  explicit Over(std::atomic<bool>& flag) noexcept : flag_(flag) {}
  Over(const Over&) = delete;
  Over& operator=(const Over&) = delete;
  ~Over() {
    flag_.store(true);
    flag_.notify_all();
  }

 private:
  std::atomic<bool>& flag_;
};

}  // namespace

RunObject run_scene(Scene scene, const RunOptions& options, ModelCache* models) {
  if (options.press.given() && !options.probes.empty()) {
    throw Error("pass either a press or a probe, not both");
  }
  if (!options.probes.empty()) or_throw(set_probes(scene, options.probes));
  if (options.seed) scene.set_seed(*options.seed);
  scene.sinks.insert(scene.sinks.end(), options.sinks.begin(), options.sinks.end());
  const ReadFiles files;
  RunPreparation preparation{.fast = true, .probes = probes_of(options, scene), .models = models};

  RunObject result;
  const GilRelease no_gil;
  if (scene.spike_time_us) static_cast<void>(or_throw(make_plan(scene)));
  PreparedRun run = or_throw(prepare_run(std::move(scene), std::move(preparation)));
  result.notices = run.notices;
  if (const auto duration = duration_of(options.duration_s)) run.parameters.duration = duration;
  run.parameters.on_notice = [&](const std::string& notice) { result.notices.push_back(notice); };
  bool interrupted = false;
  std::unique_ptr<Pipeline> pipeline;
  run.parameters.on_progress = [&](const RunProgress&) {
    const GilAcquire gil;
    if (!interrupted && PyErr_CheckSignals() != 0) {
      interrupted = true;
      pipeline->request_stop_now();
    }
  };
  pipeline = or_throw(run.pipeline_to(run.scene.sinks, {.overwrite = options.overwrite}));
  SpikeHash hash;
  pipeline->add_sink(std::make_unique<RecordCallback>(
      "python", kKinds<SpikeEvent, StimulationCommand>, [&](const RecordBatch& batch) {
        hash.add(batch.spikes);
        for (const SpikeEvent& each : batch.spikes) result.spikes.push_back(row_of(each, {}));
        for (const auto& each : batch.commands) result.stimulation.push_back(row_of(each, {}));
      }));
  std::atomic<bool> over{false};
  const LiveRun live([&] {
    pipeline->request_stop_now();
    over.wait(false);
  });
  auto report = [&] {
    const Over at_end(over);
    return pipeline->run();
  }();
  if (interrupted) {
    const GilAcquire gil;
    throw py::error_already_set();
  }
  if (std::string failure = failure_of(report); !failure.empty()) throw Error(failure);
  result.spike_hash = hash.text();
  result.afferents = afferent_rows(run.model->parameters());
  result.start_s = units::s_from(report->start);
  result.duration_s = units::s_from(report->simulated);
  result.counters = counters_of(*report);
  result.verdict = findings_text(verdict_of(*report, *run.model));
  if (models != nullptr) models->keep(run.model_key, std::move(run.model));
  return result;
}

py::array_t<double> RunObject::times(std::uint32_t neuron) const {
  if (neuron == 0 || neuron > afferents.size()) {
    throw Error("there is no neuron " + std::to_string(neuron) +
                ": neurons are numbered from 1 to " + std::to_string(afferents.size()));
  }
  std::vector<double> of_neuron;
  for (const SpikeRow& spike : spikes) {
    if (neuron_of(spike) == neuron) of_neuron.push_back(time_s_of(spike));
  }
  return py::array_t<double>(static_cast<py::ssize_t>(of_neuron.size()), of_neuron.data());
}

std::size_t RunObject::bins(double bin_s) const {
  if (!(bin_s > 0.0) || !(duration_s / bin_s <= kMaxBins)) {
    throw Error("bin_s must be a positive number of seconds and give at most 1e8 bins, but is " +
                shortest_decimal(bin_s));
  }
  // A whole number of bins is not one more because of a rounding.
  return std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(duration_s / bin_s - 1e-9)));
}

std::size_t RunObject::bin_of(const SpikeRow& spike, double bin_s) const {
  const double place = std::max(0.0, (time_s_of(spike) - start_s) / bin_s);
  return std::min(static_cast<std::size_t>(place), bins(bin_s) - 1);
}

py::array_t<double> RunObject::rate(double bin_s) const {
  py::array_t<double> rates({bins(bin_s), afferents.size()});
  std::fill_n(rates.mutable_data(), rates.size(), 0.0);
  auto cell = rates.mutable_unchecked<2>();
  for (const SpikeRow& spike : spikes) {
    cell(static_cast<py::ssize_t>(bin_of(spike, bin_s)), neuron_of(spike) - 1) += 1.0 / bin_s;
  }
  return rates;
}

py::array_t<double> RunObject::psth(double bin_s) const {
  py::array_t<double> rates(static_cast<py::ssize_t>(bins(bin_s)));
  std::fill_n(rates.mutable_data(), rates.size(), 0.0);
  auto cell = rates.mutable_unchecked<1>();
  const double share = afferents.empty() ? 0.0 : 1.0 / static_cast<double>(afferents.size());
  for (const SpikeRow& spike : spikes) {
    cell(static_cast<py::ssize_t>(bin_of(spike, bin_s))) += share / bin_s;
  }
  return rates;
}

namespace {

/// The bytes of rows, for pickle.
template <class Row>
py::bytes bytes_of(const std::vector<Row>& rows) {
  static_assert(std::is_trivially_copyable_v<Row>);
  return {reinterpret_cast<const char*>(rows.data()), rows.size() * sizeof(Row)};
}

template <class Row>
void read_rows(const py::handle& bytes, std::vector<Row>& rows) {
  const auto text = bytes.cast<std::string_view>();
  if (text.size() % sizeof(Row) != 0)
    throw Error("this pickled Run is of another version of merkel");
  rows.resize(text.size() / sizeof(Row));
  if (!rows.empty()) std::memcpy(rows.data(), text.data(), text.size());
}

py::tuple state_of(const RunObject& run) {
  return py::make_tuple(bytes_of(run.spikes), bytes_of(run.stimulation), bytes_of(run.afferents),
                        run.start_s, run.duration_s, run.counters, run.notices, run.verdict,
                        run.spike_hash);
}

RunObject run_of(const py::tuple& state) {
  if (state.size() != 9) throw Error("this pickled Run is of another version of merkel");
  RunObject run;
  read_rows(state[0], run.spikes);
  read_rows(state[1], run.stimulation);
  read_rows(state[2], run.afferents);
  run.start_s = state[3].cast<double>();
  run.duration_s = state[4].cast<double>();
  run.counters = state[5].cast<std::map<std::string, std::uint64_t>>();
  run.notices = state[6].cast<std::vector<std::string>>();
  run.verdict = state[7].cast<std::string>();
  run.spike_hash = state[8].cast<std::string>();
  return run;
}

}  // namespace

void add_run(py::module_& module) {
  py::class_<RunObject>(module, "Run", R"(The result of a batch run.)")
      .def_property_readonly(
          "spikes", [](const RunObject& run) { return array_of(run.spikes); },
          "(spikes,) of time_s, neuron, patch and flags, in order of time.")
      .def_property_readonly(
          "afferents", [](const RunObject& run) { return array_of(run.afferents); },
          "(afferents,) of neuron, patch, x_mm, y_mm, field_radius_mm and receptors.")
      .def_property_readonly(
          "stimulation", [](const RunObject& run) { return array_of(run.stimulation); },
          "(commands,) for the scene's electrodes: time_s, electrode (from 0), kind (0 update, 1 "
          "pulse), amplitude_uA, frequency_Hz, heartbeat and stop (0 none, 1 released, 2 gap, 3 "
          "neuron reset, 4 sink failure, 5 end, 6 stale).")
      .def_readonly("start_s", &RunObject::start_s, "When the first tick began, in s.")
      .def_readonly("duration_s", &RunObject::duration_s, "Simulated time, in s.")
      .def_readonly("counters", &RunObject::counters, "The run's counters, by name.")
      .def_readonly("notices", &RunObject::notices, "Messages for the user.")
      .def_readonly("verdict", &RunObject::verdict,
                    "What was lost and what to do, as `merkel run` reports it; ok if nothing was.")
      .def_readonly("spike_hash", &RunObject::spike_hash,
                    "A hash of the times and neurons of all spikes: equal runs have the same one.")
      .def(
          "times", &RunObject::times, py::arg("neuron"),
          "Spike times of one neuron, counted from 1, in s: (spikes,). Raises Error if there is no such neuron.")
      .def("rate", &RunObject::rate, py::arg("bin_s"),
           "Rates in Hz in bins of bin_s seconds from start_s: (bins, afferents).")
      .def("psth", &RunObject::psth, py::arg("bin_s"),
           "Mean rate of an afferent in Hz in bins of bin_s seconds from start_s: (bins,).")
      .def(py::pickle(&state_of, &run_of))
      .def("__repr__", [](const RunObject& run) {
        return "<Run: " + std::to_string(run.spikes.size()) + " spikes of " +
               std::to_string(run.afferents.size()) + " afferents in " +
               shortest_decimal(run.duration_s) + " s>";
      });
}

}  // namespace merkel::python
