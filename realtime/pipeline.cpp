#include "realtime/pipeline.hpp"

#include <algorithm>
#include <atomic>
#include <semaphore>
#include <span>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/printed.hpp"
#include "core/units.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "realtime/clocks/virtual_clock.hpp"
#include "realtime/input/drive_input.hpp"
#include "realtime/loop/fixed_step_loop.hpp"
#include "realtime/output/fanout.hpp"
#include "realtime/output/run_watch.hpp"
#include "realtime/run_probes.hpp"
#include "realtime/run_sinks.hpp"
#include "realtime/threads/processor_share.hpp"
#include "realtime/threads/raised_threads.hpp"
#include "realtime/threads/thread_rights.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr std::int64_t kLiveCatchUp = 20;
constexpr std::size_t kEventQueue = 1024;
constexpr milliseconds kMaxBehind{4000};  ///< the first tick begins at most this long before now
constexpr nanoseconds kProgressEvery{250'000'000};
constexpr double kMinGain = 0.05;                 ///< seconds caught up in a second
constexpr double kMuchOfTick = 0.8;               ///< the loop rests for the rest of it
constexpr nanoseconds kLongCatchUp{500'000'000};  ///< a longer one is reported

/// The simulated time, skipped ticks included.
nanoseconds simulated_in(const RunCounters& counters, nanoseconds tick) {
  return static_cast<std::int64_t>(counters.ticks + counters.skipped_ticks) * tick;
}

}  // namespace

std::string RunReport::failure() const {
  if (!error_message.empty()) return error_message;
  for (const OfSink& sink : sinks) {
    if (!sink.error_message.empty()) return sink.error_message;
  }
  return {};
}

std::string failure_of(const Expected<RunReport, SetupError>& report) {
  return report ? report->failure() : report.error().sentence;
}

bool RunReport::complete() const {
  return error_message.empty() && std::all_of(sinks.begin(), sinks.end(), [](const OfSink& sink) {
           return sink.error_message.empty() && sink.delivered == sink.spikes_in;
         });
}

/// The parts of a pipeline. The loop runs on a separate thread; everything else here on that
/// of Pipeline::run().
struct Pipeline::Parts {
  Parts(TactileModel& the_model, Parameters the_parameters)
      : model(the_model),
        parameters(std::move(the_parameters)),
        sinks(fanout, probes, watch,
              {.neurons = model.neurons(),
               .commands = parameters.encoder != nullptr,
               .arrays = model.parameters().has_arrays(),
               .fast = parameters.fast}) {}
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;
  /// The readers of a run that failed to start still fill the sinks' feeds.
  ~Parts() { probes.stop(); }

  Expected<void, SetupError> start_probes();
  void guard_commands();
  Expected<void, SetupError> set_delay();
  template <class C>
  void run_loop(C& clock, RunReport& report);
  template <class C>
  void simulate(C& clock, RunReport& report, HostTimeReport& host);
  void attend(const HostTimeReport& host, pthread_t simulation, RunReport& report);
  void set_origin(nanoseconds start);
  void follow_switch(RunReport& report);
  void drain_events(RunReport& report);
  void report_uncertain_zero(std::size_t probe);
  void report_ceiling();
  void report_catch_up(nanoseconds elapsed);
  void finish(RunReport& report);
  [[nodiscard]] RunCounters counters() const;
  [[nodiscard]] RunStatus status() const;

  TactileModel& model;
  Parameters parameters;
  RunProbes probes;
  Fanout fanout;
  LoopStatistics statistics;
  BoundedQueue<LoopEvent> events{kEventQueue};
  DriveInput drives;
  SharedOrigin origin;
  RunStatus::Rights rights;
  std::atomic<bool> rights_known{false};  ///< set after `rights`
  std::atomic<std::int64_t> delay_ns{0};
  DelayControl::Shortage shortage;
  nanoseconds ceiling_reached{0};  ///< of a delay that does not suffice, once reported
  bool catch_up_reported = false;
  std::uint16_t stops_by_hand = 0;  ///< reported
  RecentLatency recent;
  RunWatch watch{fanout.beat(), delay_ns};
  std::optional<StallWatch> stalls;  ///< if a delay is measured
  nanoseconds starting_since{0};     ///< the end of that measurement
  std::atomic<bool> started{false};  ///< the first tick is about to be simulated
  std::atomic<bool> done{false};     ///< the last tick was simulated
  std::binary_semaphore ended{0};    ///< released after `done`: ends a pause between two looks
  std::atomic<bool> stop{false};
  std::atomic<bool> end_now{false};
  RunSinks sinks;  ///< its threads use all of the above
};

Pipeline::Pipeline(TactileModel& model, Parameters parameters)
    : parts_(std::make_unique<Parts>(model, std::move(parameters))) {}

Pipeline::~Pipeline() = default;

void Pipeline::add_probe(std::unique_ptr<Probe> probe, const ProbeInput::Parameters& parameters) {
  const std::size_t next = parts_->probes.size();
  parts_->probes.add(std::move(probe), {{.probe = next, .parameters = parameters}});
}

void Pipeline::add_device(std::unique_ptr<Probe> device, const std::vector<RunInput>& inputs) {
  parts_->probes.add(std::move(device), inputs);
}

void Pipeline::add_sink(std::unique_ptr<Sink> sink) { parts_->sinks.add(std::move(sink)); }

SpikeConsumer Pipeline::add_consumer(std::size_t capacity) {
  return SpikeConsumer(parts_->fanout.add_consumer(capacity));
}

void Pipeline::request_stop() noexcept { parts_->stop.store(true, std::memory_order_relaxed); }

void Pipeline::request_stop_now() noexcept {
  parts_->end_now.store(true, std::memory_order_relaxed);
  request_stop();
}

bool Pipeline::give_drive(const GivenDrive& drive) { return parts_->drives.give(drive); }

StimulationSwitch& Pipeline::stimulation() noexcept { return parts_->watch.stimulation(); }

const LoopStatistics& Pipeline::statistics() const noexcept { return parts_->statistics; }

RunCounters Pipeline::counters() const { return parts_->counters(); }

RunStatus Pipeline::status() const { return parts_->status(); }

Expected<RunReport, SetupError> Pipeline::run() {
  Parts& parts = *parts_;
  if (auto started = parts.start_probes(); !started) {
    return Unexpected<SetupError>(started.error());
  }
  if (auto set = parts.set_delay(); !set) return Unexpected<SetupError>(set.error());
  RunReport report;
  report.probes.resize(parts.probes.size());
  parts.guard_commands();
  parts.sinks.start([&parts] { return parts.status(); }, parts.origin, parts.parameters.realtime);
  if (parts.parameters.fast) {
    VirtualClock clock(parts.stop);
    parts.run_loop(clock, report);
  } else {
    PeriodicClock clock({.wait = parts.parameters.wait,
                         .period = parts.model.parameters().tick,
                         .team = parts.parameters.team,
                         .beat = &parts.fanout.beat()});
    parts.run_loop(clock, report);
  }
  parts.finish(report);
  return report;
}

Expected<void, SetupError> Pipeline::Parts::start_probes() {
  if (probes.size() != model.indenters() || !probes.complete()) {
    return bad_input("the scene has " + std::to_string(model.indenters()) + " indenters, but " +
                     std::to_string(probes.size()) + " probes: pass one probe per indenter");
  }
  if (parameters.fast && !probes.all_replayed()) {
    return bad_input("a device cannot be read faster than real time: remove --fast");
  }
  sinks.listen();
  probes.start([this](auto... of) { return sinks.add_sample_feeds(of...); },
               parameters.fast ? std::nullopt : std::optional(parameters.realtime));
  return probes.wait_for_first_samples(stop);
}

/// On a virtual clock there is no receiver that acts in wall time.
void Pipeline::Parts::guard_commands() {
  if (parameters.fast || parameters.encoder == nullptr) return;
  watch.guard(parameters.encoder->parameters(), model.parameters().tick,
              model.parameters().patches.size());
  std::vector<std::size_t> patches;
  for (const Indenter& indenter : model.parameters().indenters) patches.push_back(indenter.patch);
  probes.add_devices_to(watch, patches);
}

/// Measures the timing of the devices, and sets the delay of the first tick.
Expected<void, SetupError> Pipeline::Parts::set_delay() {
  if (!parameters.delay) {
    if (!probes.all_replayed()) stalls.emplace(parameters.realtime);
    probes.wait_for_timing(stop);
    if (auto checked = probes.check_ceilings(); !checked) return checked;
    probes.measure_delays();
  }
  starting_since = PeriodicClock::now();
  delay_ns.store(parameters.delay.value_or(probes.measured_delay()).count());
  if (parameters.fast || parameters.encoder == nullptr) return {};
  return probes.check_watchdog(parameters.encoder->parameters().stimulation.watchdog);
}

template <class C>
void Pipeline::Parts::run_loop(C& clock, RunReport& report) {
  constexpr bool kHostTime = std::is_same_v<C, PeriodicClock>;
  HostTimeReport host{.wait = parameters.wait};
  std::optional<ProcessSetup> process;
  if constexpr (kHostTime) process.emplace(parameters.realtime, host.rights);
  std::jthread simulation([&] { simulate(clock, report, host); });
  attend(host, simulation.native_handle(), report);
  simulation.join();
  drain_events(report);
  if constexpr (kHostTime) {
    host.margin = clock.margin();
    host.wake_up = LatencySummary::of(statistics.wake_up.snapshot());
    if (!probes.all_replayed()) {
      host.sample_to_spike = LatencySummary::of(statistics.sample_to_spike.snapshot());
      host.sample_to_command = LatencySummary::of(statistics.sample_to_command.snapshot());
      host.recent_sample_to_spike =
          LatencySummary::of(statistics.sample_to_spike.snapshot().since(recent.before().spike));
      host.recent_sample_to_command = LatencySummary::of(
          statistics.sample_to_command.snapshot().since(recent.before().command));
      host.way = LatencySummary::of(statistics.way.snapshot());
      host.tick_end = LatencySummary::of(statistics.tick_end.snapshot());
      host.delay = LatencySummary::of(statistics.delay.snapshot());
      host.queue = LatencySummary::of(statistics.queue.snapshot());
    }
    host.tick = LatencySummary::of(statistics.tick.snapshot());
    host.processor = LatencySummary::of(statistics.processor.snapshot());
    host.publish = LatencySummary::of(statistics.publish.snapshot());
    report.host_time = std::move(host);
  }
}

/// The simulation thread, from its set-up to its report.
template <class C>
void Pipeline::Parts::simulate(C& clock, RunReport& report, HostTimeReport& host) {
  if constexpr (std::is_same_v<C, PeriodicClock>) {
    set_up_simulation_thread(parameters.realtime, host.rights);
    clock.calibrate();
    rights = rights_of_this_thread();
    rights.cpu_awake = host.rights.cpu_awake ? 1 : 0;
    rights_known.store(true, std::memory_order_release);
  }
  const bool all_replayed = probes.all_replayed();
  const nanoseconds delay{delay_ns.load()};
  const nanoseconds now = clock.now();
  const auto [earliest, latest] = probes.first_times();
  // Recordings play from their first sample, whatever its time. With devices, the run starts when
  // the last device has sent a sample.
  report.start = all_replayed ? earliest
                              : probes.aligned(std::max(latest, now - delay - kMaxBehind),
                                               model.parameters().tick);
  probes.set_ticks(report.start, model.parameters().tick);
  set_origin(report.start);
  watch.set_wall_offset(all_replayed ? now - report.start : nanoseconds{0});
  DelayControl delay_control(delay_ns, shortage);
  FixedStepLoop<C> loop({.start = report.start,
                         .wall_offset = all_replayed ? now - report.start : nanoseconds{0},
                         .delay = delay,
                         .delay_control = parameters.delay ? nullptr : &delay_control,
                         .stalls = stalls ? &*stalls : nullptr,
                         .starts_behind = !all_replayed,
                         .starting_since = starting_since,
                         .duration = parameters.duration,
                         .max_catch_up_ticks = parameters.max_catch_up_ticks.value_or(
                             all_replayed ? INT64_MAX : kLiveCatchUp),
                         .encoder = parameters.encoder,
                         .drives = &drives,
                         .without_gate = parameters.fast,
                         .timings = parameters.timings},
                        clock, model, probes.inputs(), fanout, statistics, events);
  started.store(true, std::memory_order_release);
  started.notify_one();
  const ThreadUsage before = ThreadUsage::of_this_thread();
  const nanoseconds loop_start = PeriodicClock::now();
  loop.run(stop);
  report.wall = PeriodicClock::now() - loop_start;
  host.usage = ThreadUsage::of_this_thread().since(before);
  stalls.reset();
  const auto copy = [](std::span<const std::uint64_t> from, std::vector<std::uint64_t>& to) {
    to.assign(from.begin(), from.end());
  };
  copy(loop.tally().spikes_of_neuron(), report.spikes_of_neuron);
  copy(loop.tally().contact_spikes_of_neuron(), report.contact_spikes_of_neuron);
  copy(loop.tally().contact_ticks_of_patch(), report.contact_ticks_of_patch);
  for (std::size_t i = 0; i < report.probes.size(); ++i) {
    report.probes[i].deepest_press = loop.tally().presses()[i].press();
    report.probes[i].press_range = loop.tally().presses()[i].range();
  }
  done.store(true, std::memory_order_release);
  ended.release();
}

/// Recordings keep their own time origin; with devices, the origin is the start of the run.
void Pipeline::Parts::set_origin(nanoseconds start) {
  const auto recorded = probes.recorded_run();
  if (recorded && recorded->utc.count() != 0) {
    origin.set({.start = recorded->zero, .utc = recorded->utc});
    return;
  }
  const ClockPair clocks = read_clock_pair();
  const bool all_replayed = probes.all_replayed();
  const nanoseconds zero = recorded ? recorded->zero : all_replayed ? nanoseconds{0} : start;
  const nanoseconds zero_on_host = all_replayed ? clocks.monotonic - (start - zero) : start;
  origin.set({.start = zero, .utc = clocks.utc - (clocks.monotonic - zero_on_host)});
}

/// Attends to events, notices, failures and progress while the loop runs.
void Pipeline::Parts::attend(const HostTimeReport& host, pthread_t simulation, RunReport& report) {
  started.wait(false, std::memory_order_acquire);
  const nanoseconds loop_start = PeriodicClock::now();
  for (const std::string& sentence : host.rights.missing) {
    if (parameters.on_missing_right) parameters.on_missing_right(sentence);
  }
  nanoseconds last_progress = loop_start;
  ProcessorShare share;
  while (!done.load(std::memory_order_acquire)) {
    drain_events(report);
    follow_switch(report);
    sinks.report_failures(parameters.on_sink_failure);
    sinks.take_notices(parameters.on_notice);
    recent.look(statistics, PeriodicClock::now());
    static_cast<void>(ended.try_acquire_for(milliseconds{parameters.fast ? 1 : 20}));
    const nanoseconds now = PeriodicClock::now();
    report_catch_up(now - loop_start);
    if (host.rights.fifo && !done.load(std::memory_order_acquire) &&
        share.too_large(now, processor_time(simulation))) {
      demote_raised_threads();
    }
    if (parameters.on_progress && now - last_progress >= kProgressEvery) {
      last_progress = now;
      const RunCounters counted = counters();
      parameters.on_progress({.probes = probes.readings(),
                              .wall = now - loop_start,
                              .simulated = simulated_in(counted, model.parameters().tick),
                              .known = std::min(probes.newest() - report.start,
                                                parameters.duration.value_or(nanoseconds::max())),
                              .counters = counted,
                              .wake_up = statistics.wake_up.snapshot(),
                              .tick = statistics.tick.snapshot()});
    }
  }
}

/// Reports a stop of stimulation by hand, and its end, also to the sinks that take marks.
void Pipeline::Parts::follow_switch(RunReport& report) {
  using By = StimulationSwitch::By;
  const StimulationSwitch::State now = watch.stimulation().state();
  if (parameters.encoder == nullptr) return;
  const nanoseconds at = simulated_in(counters(), model.parameters().tick);
  const auto say = [&](const std::string& sentence, const char* effect) {
    sinks.mark({.time = report.start + at, .label = sentence});
    if (parameters.on_notice) parameters.on_notice(sentence + effect);
  };
  const bool stops = std::exchange(stops_by_hand, now.stops) != now.stops;
  const bool was_stopped = report.stimulation_stopped != By::kNone;
  const auto say_start = [&] {
    say("stimulation started again", ": amplitudes rise from 0 within the limits");
  };
  if (stops && was_stopped) say_start();
  if (stops) {
    report.stimulation_stop = {.by = now.last, .at = at};
    say("stimulation stopped by " + std::string(name_of(now.last)),
        ": all electrodes are off until it is started again");
  }
  if ((stops || was_stopped) && now.by == By::kNone) say_start();
  report.stimulation_stopped = now.by;
}

void Pipeline::Parts::drain_events(RunReport& report) {
  report_ceiling();
  LoopEvent event;
  while (events.try_pop(event)) {
    if (event.kind == LoopEvent::Kind::kRelease) ++report.probes[event.subject].releases;
    if (parameters.on_event) parameters.on_event(event);
    if (event.kind == LoopEvent::Kind::kZeroUncertain) report_uncertain_zero(event.subject);
  }
  probes.take_notices(parameters.on_notice);
}

void Pipeline::Parts::report_uncertain_zero(std::size_t probe) {
  const ProbeInfo& info = probes.info(probe);
  if (info.replayed || !parameters.on_notice) return;
  parameters.on_notice(info.name +
                       ": its zero is uncertain: its force may be drift, and stimulation is "
                       "suspended; lift the probe, or tare it (in the live page)");
}

void Pipeline::Parts::report_ceiling() {
  const nanoseconds needed{shortage.needed_ns.load(std::memory_order_relaxed)};
  if (needed.count() == 0 || ceiling_reached.count() != 0) return;
  ceiling_reached = nanoseconds{shortage.ceiling_ns.load(std::memory_order_relaxed)};
  if (!parameters.on_notice) return;
  parameters.on_notice(printed(
      "samples arrive up to %.3g ms late, and the delay of the loop follows them up to %.3g ms "
      "only ([probe] max_delay_ms): ticks without their sample hold the last one and are counted",
      units::ms_from(needed), units::ms_from(ceiling_reached)));
}

/// The first samples of devices wait until their timing is measured.
/// \param elapsed  since the first tick
void Pipeline::Parts::report_catch_up(nanoseconds elapsed) {
  const nanoseconds behind{statistics.behind_at_start_ns.load(std::memory_order_relaxed)};
  if (catch_up_reported || elapsed < kLongCatchUp || behind.count() == 0) return;
  catch_up_reported = true;
  if (!parameters.on_notice) return;
  const nanoseconds simulated = simulated_in(counters(), model.parameters().tick);
  const double gain = units::s_from(simulated) / units::s_from(elapsed) - 1.0;
  const double tick_ms = units::ms_from(model.parameters().tick);
  const double used_ms = units::ms_from(statistics.processor.snapshot().quantile(0.5));
  std::string outlook =
      "it does not catch up, because this machine stops the loop: see merkel doctor, and what else "
      "runs on it";
  if (gain > kMinGain) {
    outlook = printed("it catches up within about %.2g s", units::s_from(behind) / gain);
  } else if (used_ms > kMuchOfTick * tick_ms) {
    outlook = printed(
        "it does not catch up, because a tick computes for %.3g ms and lasts %.3g ms: simplify the "
        "scene (merkel plan)",
        used_ms, tick_ms);
  }
  parameters.on_notice(printed("the simulation is %.2g s behind its devices, which were measured "
                               "before its first tick; ",
                               units::s_from(behind)) +
                       outlook);
}

void Pipeline::Parts::finish(RunReport& report) {
  report.interrupted = stop.load(std::memory_order_relaxed);
  follow_switch(report);
  probes.finish(report);
  static_cast<RunCounters&>(report) = counters();
  report.delay = nanoseconds{delay_ns.load()};
  report.delay_measured = !parameters.delay;
  report.delay_ceiling = ceiling_reached;
  const auto delays = statistics.delay.snapshot();
  report.smallest_delay = delays.quantile(0.0);
  report.median_delay = delays.quantile(0.5);
  report.largest_delay = delays.longest();
  report.simulated = simulated_in(report, model.parameters().tick);
  sinks.finish(report, parameters.ending_patience, end_now);
  static_cast<RunCounters&>(report) = counters();  // sinks may have refused the last commands
  sinks.take_notices(parameters.on_notice);
}

RunCounters Pipeline::Parts::counters() const {
  RunCounters counters = statistics.snapshot();
  counters.spikes_dropped = fanout.dropped<SpikeEvent>();
  counters.commands_dropped = fanout.dropped<StimulationCommand>() + fanout.dropped<SentCommand>() +
                              fanout.dropped<GivenDrive>();
  counters.commands_refused = fanout.refused();
  watch.add_to(counters);
  const bool host_time = rights_known.load(std::memory_order_acquire);
  counters.demotions = host_time && simulation_was_demoted() ? 1 : 0;
  probes.add_to(counters);
  return counters;
}

RunStatus Pipeline::Parts::status() const {
  RunStatus status{.counters = counters(), .losses = {}, .rights = {}};
  if (rights_known.load(std::memory_order_acquire)) {
    status.rights = rights;
    if (simulation_was_demoted()) status.rights.scheduling_class = status.rights.priority = 0;
  }
  return status;
}

}  // namespace merkel
