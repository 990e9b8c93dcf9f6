#include "tools/python/src/bridge_object.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <pybind11/stl.h>
#include <unistd.h>

#include "core/units.hpp"
#include "tools/python/src/interpreter_exit.hpp"
#include "tools/python/src/run_object.hpp"
#include "tools/python/src/scene_object.hpp"
#include "tools/scene/session_scene.hpp"
#include "tools/studies/plan/plan.hpp"

namespace merkel::python {
namespace {

namespace py = pybind11;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kSignalsEvery{50};
constexpr std::chrono::seconds kFirstTickWithin{10};

}  // namespace

/// The sink that Python reads from. It never waits: a full list would hold up the commands, and
/// lost commands switch all electrodes off.
class BridgeObject::Outlet final : public Sink {
 public:
  explicit Outlet(BridgeObject& bridge) : Sink("python"), bridge_(bridge) {}

  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<SpikeEvent, SentCommand, TickRecord>;
  }
  void attach(RunControl& control) override { bridge_.control_ = &control; }
  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    keep(batch.spikes, bridge_.unread_.spikes, bridge_.spikes_lost_);
    delivered_ += batch.spikes.size();
    commands_.clear();
    for (const SentCommand& sent : batch.sent) commands_.push_back(sent.command);
    keep(std::span<const StimulationCommand>(commands_), bridge_.unread_.commands,
         bridge_.commands_lost_);
    if (batch.ticks.empty()) return {};
    const std::lock_guard lock(bridge_.mutex_);
    const bool first = !bridge_.newest_;
    bridge_.newest_ = batch.ticks.back().time;
    if (first) bridge_.changed_.notify_all();
    return {};
  }
  [[nodiscard]] Expected<void, SinkError> close() override { return {}; }

 private:
  template <class Event, class Row>
  void keep(std::span<const Event> events, std::vector<Row>& unread, std::uint64_t& lost) {
    if (events.empty()) return;
    const std::lock_guard lock(bridge_.mutex_);
    const std::size_t room = bridge_.most_unread_ - std::min(bridge_.most_unread_, unread.size());
    const auto kept = events.first(std::min(room, events.size()));
    for (const Event& each : kept) unread.push_back(row_of(each, nanoseconds{0}));
    const std::uint64_t more = events.size() - kept.size();
    if (more > 0 && bridge_.spikes_lost_ + bridge_.commands_lost_ == 0) {
      bridge_.notices_.emplace_back(
          "Python has not read for so long that its copies are lost (counters python_spikes_lost and "
          "python_commands_lost; sinks are not affected): read more often, or raise most_unread");
    }
    lost += more;
    bridge_.changed_.notify_all();
  }

  BridgeObject& bridge_;
  std::vector<StimulationCommand> commands_;
};

BridgeObject::BridgeObject(Scene scene, const Options& options)
    : most_unread_(options.most_unread), process_(::getpid()) {
  if (most_unread_ == 0) {
    throw Error("most_unread must be at least 1, but is 0: no spike could reach Python");
  }
  scene.sinks.insert(scene.sinks.end(), options.sinks.begin(), options.sinks.end());
  if (scene.spike_time_us) static_cast<void>(or_throw(make_plan(scene)));
  run_ = std::make_unique<PreparedRun>(or_throw(
      prepare_run(std::move(scene), {.allow_remote = options.allow_remote, .gives_drives = true})));
  const auto notice = [this](const std::string& sentence) {
    const std::lock_guard lock(mutex_);
    notices_.push_back(sentence);
  };
  for (const std::string& sentence : run_->notices) notice(sentence);
  run_->parameters.on_notice = run_->parameters.on_missing_right = notice;
  run_->parameters.on_sink_failure = [notice](const std::string& uri, const std::string& error) {
    notice("the sink " + uri + " was closed and the run continues: " + error);
  };
  if (const auto duration = duration_of(options.duration_s)) {
    run_->parameters.duration = duration;
  }
  pipeline_ = or_throw(run_->pipeline_to(
      run_->scene.sinks, {.overwrite = options.overwrite, .allow_remote = options.allow_remote},
      [&](const std::string& address) { notice("live page: " + address); }));
  pipeline_->add_sink(std::make_unique<Outlet>(*this));
  files_.complete();
  thread_ = std::thread([this] { run(); });
  live_.emplace([this] { stop(); });
}

BridgeObject::~BridgeObject() { stop(); }

bool BridgeObject::is_own_process() const noexcept { return ::getpid() == process_; }

void BridgeObject::check_process() const {
  if (is_own_process()) return;
  throw Error(
      "this Bridge runs in the process that called connect(), not in this fork of it: connect in "
      "this process");
}

void BridgeObject::run() {
  const auto report = pipeline_->run();
  const std::lock_guard lock(mutex_);
  error_ = failure_of(report);
  over_ = true;
  changed_.notify_all();
}

BridgeObject::Unread BridgeObject::read(nanoseconds patience) {
  check_process();
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, patience, [this] { return !unread_.empty() || over_; });
  Unread unread = std::exchange(unread_, {});
  const std::string error = unread.empty() && over_ ? std::exchange(error_, {}) : std::string();
  lock.unlock();
  changed_.notify_all();
  if (!error.empty()) throw Error(error);
  return unread;
}

bool BridgeObject::ended() {
  check_process();
  const std::lock_guard lock(mutex_);
  return over_ && unread_.empty() && error_.empty();
}

void BridgeObject::stop() noexcept {
  if (!is_own_process()) return;
  pipeline_->request_stop();
  const std::lock_guard lock(ending_);
  if (thread_.joinable()) thread_.join();
}

void BridgeObject::set_drive(const std::string& electrode, double amplitude,
                             std::optional<double> frequency) {
  check_process();
  const auto drive =
      run_->scene.encoding.own_drive(electrode, amplitude, frequency.value_or(amplitude));
  if (!drive) throw Error(drive.error());
  if (!pipeline_->give_drive(*drive)) {
    wait_if_exiting();
    throw Error("the run takes no drives now: it is over, or its probe has sent nothing yet");
  }
}

void BridgeObject::stop_stimulation() {
  check_process();
  pipeline_->stimulation().stop(StimulationSwitch::By::kProgram);
}

void BridgeObject::start_stimulation() {
  check_process();
  pipeline_->stimulation().start();
}

bool BridgeObject::started(nanoseconds patience) {
  check_process();
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, patience, [this] { return newest_ || over_; });
}

void BridgeObject::mark(const std::string& label) {
  nanoseconds time{0};
  {
    std::unique_lock lock(mutex_);
    if (over_) {
      lock.unlock();
      wait_if_exiting();
      throw Error("the run is over: there is nothing to mark");
    }
    if (!newest_) {
      throw Error(
          "the run has not simulated its first tick within 10 s: see Bridge.notices for a probe that "
          "sends nothing");
    }
    time = *newest_;
  }
  control_->mark({.time = time, .label = label});
}

bool BridgeObject::tare(std::optional<std::size_t> probe) {
  check_process();
  if (probe) return control_->tare(*probe);
  bool any = false;
  for (std::size_t i = 0; i < run_->scene.probes.size(); ++i) any = control_->tare(i) || any;
  return any;
}

std::map<std::string, std::uint64_t> BridgeObject::counters() {
  check_process();
  auto all = counters_of(pipeline_->counters());
  const std::lock_guard lock(mutex_);
  all.emplace("python_spikes_lost", spikes_lost_);
  all.emplace("python_commands_lost", commands_lost_);
  return all;
}

std::vector<std::string> BridgeObject::notices() {
  check_process();
  const std::lock_guard lock(mutex_);
  return notices_;
}

namespace {

/// Waits for spikes or commands without the GIL, so that Ctrl-C still works. Nothing at the end of
/// the patience.
BridgeObject::Unread read(BridgeObject& bridge, std::optional<nanoseconds> patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience.value_or(nanoseconds{0});
  for (;;) {
    BridgeObject::Unread unread;
    nanoseconds left = kSignalsEvery;
    if (patience) {
      left = std::clamp(deadline - std::chrono::steady_clock::now(), nanoseconds{0}, left);
    }
    {
      const GilRelease no_gil;
      unread = bridge.read(left);
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!unread.empty() || bridge.ended() || (patience && left.count() == 0)) return unread;
  }
}

/// Marks the run, after its first tick. Waits without the GIL, so that Ctrl-C still works.
void mark(BridgeObject& bridge, const std::string& label) {
  if (label.find_first_of("\r\n") != std::string::npos) {
    throw Error("a mark is one line: leave out line breaks");
  }
  const auto deadline = std::chrono::steady_clock::now() + kFirstTickWithin;
  for (bool started = false; !started && std::chrono::steady_clock::now() < deadline;) {
    {
      const GilRelease no_gil;
      started = bridge.started(kSignalsEvery);
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  bridge.mark(label);
}

py::tuple output_of(const BridgeObject::Unread& unread) {
  return output_of(array_of(unread.spikes), array_of(unread.commands));
}

}  // namespace

void add_bridge(py::module_& module) {
  py::class_<BridgeObject, BridgeHolder>(module, "Bridge",
                                         R"(The real-time pipeline, running in its own threads.

Iterate to get an Output of spikes and stimulation commands as they come, until the run ends. One of the
two may be empty, and a tick's commands may come in another Output than its spikes. Leaving the with
block ends the run.)")
      .def(
          "__enter__", [](BridgeObject& bridge) -> BridgeObject& { return bridge; },
          py::return_value_policy::reference_internal)
      .def("__exit__",
           [](BridgeObject& bridge, const py::args&) {
             const GilRelease no_gil;
             bridge.stop();
           })
      .def(
          "__iter__", [](BridgeObject& bridge) -> BridgeObject& { return bridge; },
          py::return_value_policy::reference_internal)
      .def("__next__",
           [](BridgeObject& bridge) {
             const BridgeObject::Unread unread = read(bridge, std::nullopt);
             if (unread.empty()) throw py::stop_iteration();
             return output_of(unread);
           })
      .def(
          "read",
          [](BridgeObject& bridge, double timeout_s) {
            if (std::isnan(timeout_s)) {
              throw Error("timeout_s must be a number of seconds, but is nan");
            }
            return output_of(
                read(bridge, units::nanoseconds_from_s(std::clamp(timeout_s, 0.0, 1e6))));
          },
          py::arg("timeout_s") = 0.0,
          "Returns the unread Output; both arrays are empty after timeout_s seconds without any. "
          "Raises Error if the run failed.")
      .def_property_readonly("ended", &BridgeObject::ended,
                             "True when the run is over and all its output has been read.")
      .def("stop", &BridgeObject::stop, py::call_guard<GilRelease>(),
           "Ends the run and finishes its files. Unread output can still be read.")
      .def("set_drive", &BridgeObject::set_drive, py::arg("electrode"), py::arg("amplitude"),
           py::arg("frequency") = py::none(), kSetDriveText)
      .def("stop_stimulation", &BridgeObject::stop_stimulation,
           "Switches all electrodes off within two updates, until start_stimulation().")
      .def("start_stimulation", &BridgeObject::start_stimulation,
           "Ends a stop, whoever stopped: amplitudes rise from 0 within the limits.")
      .def("mark", &mark, py::arg("label"),
           "Adds a mark with a one-line label at the current time to every session being recorded. "
           "Raises Error if the run is over or has not begun within 10 s.")
      .def(
          "tare", &BridgeObject::tare, py::arg("probe") = 0,
          "Sets a probe's zero to its current reading; None: all probes. Returns False for a recording.")
      .def_property_readonly("counters", &BridgeObject::counters,
                             "The run's counters so far, by name.")
      .def_property_readonly("notices", &BridgeObject::notices,
                             "Messages of the run so far: missing rights, outages, failures.");

  module.def(
      "connect",
      [](const std::vector<std::string>& probes, const SceneObject& scene,
         const std::vector<std::string>& sinks, std::optional<double> duration_s, bool overwrite,
         bool allow_remote, std::size_t most_unread) {
        Scene of_probe = scene.scene();
        or_throw(set_probes(of_probe, probes));
        const GilRelease no_gil;
        return BridgeHolder(new BridgeObject(std::move(of_probe),
                                             BridgeObject::Options{.sinks = sinks,
                                                                   .duration_s = duration_s,
                                                                   .overwrite = overwrite,
                                                                   .allow_remote = allow_remote,
                                                                   .most_unread = most_unread}));
      },
      py::arg("probes"), py::arg("scene"), py::kw_only(),
      py::arg("sinks") = std::vector<std::string>(), py::arg("duration_s") = py::none(),
      py::arg("overwrite") = false, py::arg("allow_remote") = false,
      py::arg("most_unread") = BridgeObject::Options{}.most_unread);
}

}  // namespace merkel::python
