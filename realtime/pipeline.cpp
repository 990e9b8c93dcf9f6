#include "realtime/pipeline.hpp"

#include <algorithm>
#include <thread>
#include <type_traits>
#include <utility>

#include "core/units.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "realtime/clocks/periodic_clock.hpp"
#include "realtime/clocks/virtual_clock.hpp"
#include "realtime/input/frame_tap.hpp"
#include "realtime/input/probe_channel.hpp"
#include "realtime/input/probe_reader.hpp"
#include "realtime/loop/fixed_step_loop.hpp"
#include "realtime/output/mark_box.hpp"
#include "realtime/output/sink_writer.hpp"
#include "realtime/threads/processor_share.hpp"
#include "realtime/threads/thread_rights.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr std::int64_t kLiveCatchUp = 20;
constexpr std::size_t kSampleQueue = 4096;
constexpr std::size_t kLargestSampleQueue = 1'000'000;
constexpr milliseconds kReadAhead{4000};  ///< how far a recording's reader runs ahead
constexpr std::size_t kSpikeQueue = 65536;
constexpr std::size_t kTickQueue = 16384;
constexpr std::size_t kEventQueue = 1024;
constexpr milliseconds kSilence{2000};  ///< a device that sends nothing for this long is refused
constexpr nanoseconds kUnknownPeriod{1'000'000};
constexpr milliseconds kMeasuring{3000};   ///< at most; one second is enough for most devices
constexpr milliseconds kMostBehind{4000};  ///< the first tick begins at most this long before now
constexpr nanoseconds kProgressEvery{250'000'000};

std::size_t queue_capacity(const ProbeInfo& info) {
  const auto period = std::max(info.period.value_or(kUnknownPeriod), nanoseconds{1});
  return std::clamp(static_cast<std::size_t>(kReadAhead / period), kSampleQueue,
                    kLargestSampleQueue);
}

}  // namespace

struct Pipeline::ProbeLine {
  ProbeLine(std::unique_ptr<Probe> the_probe, const ProbeInput::Parameters& the_parameters)
      : probe(std::move(the_probe)),
        parameters(the_parameters),
        channel(queue_capacity(probe->info())) {}
  std::unique_ptr<Probe> probe;
  ProbeInput::Parameters parameters;
  ProbeChannel channel;
  std::unique_ptr<ProbeReader> reader;
};

struct Pipeline::SinkLine {
  std::unique_ptr<RunControl> control;  ///< borrowed by the sink
  std::unique_ptr<SpikeSink> sink;
  SpikeChannel& channel;
  std::vector<std::unique_ptr<SampleTap>> taps = {};
  std::vector<std::unique_ptr<FrameTap>> frames = {};
  std::unique_ptr<MarkBox> marks = nullptr;  ///< null if not requested
  std::unique_ptr<SinkWriter> writer = nullptr;
  bool failure_told = false;
};

/// The requests that one sink may make to the run.
class Pipeline::SinkControl final : public RunControl {
 public:
  SinkControl(Pipeline& pipeline, SpikeChannel& channel) : pipeline_(pipeline), channel_(channel) {}

  void watch(std::span<const std::uint32_t> neurons) noexcept override {
    if (!channel_.watched) return;
    const std::size_t all = pipeline_.model_.neurons();
    for (std::size_t i = 0; i < kMostWatched; ++i) {
      const std::uint32_t number = i < neurons.size() && neurons[i] <= all ? neurons[i] : 0;
      channel_.watched->neurons[i].store(number, std::memory_order_relaxed);
    }
  }
  [[nodiscard]] bool tare(std::size_t probe) override {
    return pipeline_.wired_.load(std::memory_order_acquire) && probe < pipeline_.probes_.size() &&
           pipeline_.probes_[probe]->probe->request_tare();
  }
  void mark(const Mark& mark) override {
    if (!pipeline_.wired_.load(std::memory_order_acquire)) return;
    for (const auto& line : pipeline_.sinks_) {
      if (line->marks) line->marks->add(mark);
    }
  }
  [[nodiscard]] Link link(std::size_t probe) const override {
    if (!pipeline_.wired_.load(std::memory_order_acquire)) return Link::kConnected;
    const Probe& queried = *pipeline_.probes_.at(probe)->probe;
    if (queried.info().replayed) return Link::kRecording;
    return queried.connected() ? Link::kConnected : Link::kUnplugged;
  }

 private:
  Pipeline& pipeline_;
  SpikeChannel& channel_;
};

bool RunReport::complete() const {
  return error_message.empty() && std::all_of(sinks.begin(), sinks.end(), [](const OfSink& sink) {
           return sink.error_message.empty() && sink.delivered == sink.spikes_in;
         });
}

Pipeline::Pipeline(TactileModel& model, Parameters parameters)
    : model_(model), parameters_(std::move(parameters)), events_(kEventQueue) {}

Pipeline::~Pipeline() {
  // Sinks may have threads that use their RunControl until they are destroyed.
  for (const auto& line : sinks_) {
    line->writer.reset();
    line->sink.reset();
  }
}

void Pipeline::add_probe(std::unique_ptr<Probe> probe, const ProbeInput::Parameters& parameters) {
  probes_.push_back(std::make_unique<ProbeLine>(std::move(probe), parameters));
}

void Pipeline::add_sink(std::unique_ptr<SpikeSink> sink) {
  SpikeChannel& channel = fanout_.add_consumer(kSpikeQueue);
  const std::uint32_t subscriptions = sink->subscriptions();
  if ((subscriptions & SpikeSink::kTicks) != 0U) {
    channel.ticks = std::make_unique<CountedQueue<TickRecord>>(kTickQueue);
  }
  if ((subscriptions & SpikeSink::kEvents) != 0U) {
    channel.events = std::make_unique<CountedQueue<LoopEvent>>(kEventQueue);
  }
  if ((subscriptions & SpikeSink::kStimulation) != 0U && parameters_.encoder != nullptr) {
    channel.commands = std::make_unique<CountedQueue<StimulationCommand>>(kSpikeQueue);
  }
  channel.takes_spikes = sink->takes_spikes();
  if ((subscriptions & SpikeSink::kNeurons) != 0U)
    channel.watched = std::make_unique<WatchedNeurons>();
  auto line =
      std::make_unique<SinkLine>(SinkLine{.control = std::make_unique<SinkControl>(*this, channel),
                                          .sink = std::move(sink),
                                          .channel = channel});
  if ((subscriptions & SpikeSink::kMarks) != 0U) line->marks = std::make_unique<MarkBox>();
  line->sink->attach(*line->control);
  sinks_.push_back(std::move(line));
}

SpikeChannel& Pipeline::add_consumer(std::size_t capacity) {
  return fanout_.add_consumer(capacity);
}

std::vector<SampleTap*> Pipeline::add_taps(const ProbeLine& probe) {
  std::vector<SampleTap*> taps;
  for (const auto& line : sinks_) {
    if ((line->sink->subscriptions() & SpikeSink::kSamples) == 0U) continue;
    // A recording's reader fills both the loop's queue and this one before anything is drained.
    line->taps.push_back(
        std::make_unique<SampleTap>(queue_capacity(probe.probe->info()) + kSampleQueue));
    taps.push_back(line->taps.back().get());
  }
  return taps;
}

void Pipeline::add_frame_taps() {
  for (const auto& line : sinks_) {
    if ((line->sink->subscriptions() & SpikeSink::kFrames) == 0U) continue;
    for (std::size_t i = 0; i < probes_.size(); ++i) {
      Probe& probe = *probes_[i]->probe;
      for (std::size_t port = 0; port < probe.ports(); ++port) {
        line->frames.push_back(std::make_unique<FrameTap>(probe, i, port));
      }
    }
  }
}

RunCounters Pipeline::counters() const {
  RunCounters counters = statistics_.snapshot();
  counters.spikes_dropped = fanout_.dropped();
  counters.commands_dropped = fanout_.commands_dropped();
  const bool host_time = rights_known_.load(std::memory_order_acquire);
  counters.demotions = host_time && simulation_was_demoted() ? 1 : 0;
  counters.probe_count = probes_.size();
  for (const auto& line : probes_) {
    const ProbeChannel& channel = line->channel;
    counters.samples += channel.delivered.value() + channel.dropped.value();
    counters.samples_dropped += channel.dropped.value();
    counters.samples_late += channel.late.value();
    counters.held_ticks += channel.held_ticks.value();
    counters.released_ticks += channel.released_ticks.value();
    if (channel.ended.load(std::memory_order_relaxed)) ++counters.probes_ended;
  }
  return counters;
}

RunStatus Pipeline::status() const {
  RunStatus status{.counters = counters(), .losses = {}, .rights = {}};
  if (rights_known_.load(std::memory_order_acquire)) {
    status.rights = rights_;
    if (simulation_was_demoted()) status.rights.scheduling_class = status.rights.priority = 0;
  }
  return status;
}

void Pipeline::report_sink_failures() {
  for (const auto& line : sinks_) {
    if (line->failure_told) continue;
    const std::string error_message = line->writer->error_message();
    if (error_message.empty()) continue;
    line->failure_told = true;
    if (parameters_.on_sink_failure) parameters_.on_sink_failure(line->sink->uri(), error_message);
  }
}

Expected<void, SetupError> Pipeline::start_probes() {
  if (probes_.size() != model_.indenters()) {
    return bad_input("the scene has " + std::to_string(model_.indenters()) + " indenters, but " +
                     std::to_string(probes_.size()) +
                     " probes were given: give one probe per indenter");
  }
  const bool all_replayed = std::all_of(probes_.begin(), probes_.end(), [](const auto& line) {
    return line->probe->info().replayed;
  });
  if (parameters_.fast && !all_replayed) {
    return bad_input("a device cannot be read faster than real time: remove --fast");
  }
  add_frame_taps();
  for (const auto& line : probes_) {
    // Together with devices, a recording plays as if it were acquired now.
    const nanoseconds shift =
        line->probe->info().replayed && !all_replayed ? PeriodicClock::now() : nanoseconds{0};
    inputs_.emplace_back(line->channel, line->parameters);
    line->reader = std::make_unique<ProbeReader>(
        *line->probe, line->channel,
        ProbeReader::Parameters{
            .shift = shift, .taps = add_taps(*line), .wait_for_taps = parameters_.fast});
  }
  return wait_for_first_samples();
}

Expected<void, SetupError> Pipeline::wait_for_first_samples() {
  const nanoseconds deadline = PeriodicClock::now() + kSilence;
  for (std::size_t i = 0; i < probes_.size(); ++i) {
    const ProbeChannel& channel = probes_[i]->channel;
    // A recording starts with a well-filled queue, so that none of its samples is late.
    const std::uint64_t wanted = probes_[i]->probe->info().replayed ? kSampleQueue / 2 : 1;
    while (channel.delivered.value() < wanted && !channel.ended.load(std::memory_order_acquire) &&
           !stop_.load(std::memory_order_relaxed)) {
      if (PeriodicClock::now() > deadline) {
        if (channel.delivered.value() > 0) break;
        return unavailable("the probe " + probes_[i]->probe->info().uri + " has sent nothing for " +
                           std::to_string(kSilence.count() / 1000) +
                           " s: check that it is switched on and streaming");
      }
      std::this_thread::sleep_for(milliseconds{1});
    }
  }
  for (std::size_t i = 0; i < probes_.size(); ++i) {
    if (inputs_[i].first_time()) continue;
    probes_[i]->reader->stop();
    const std::string& error_message = probes_[i]->reader->error_message();
    const bool of_device = !probes_[i]->probe->info().replayed;
    return Unexpected<SetupError>(
        {.kind = of_device ? SetupError::Kind::kUnavailable : SetupError::Kind::kBadInput,
         .sentence = error_message.empty() ? "the probe " + probes_[i]->probe->info().uri +
                                                 " gave no samples: nothing can be simulated"
                                           : error_message});
  }
  return {};
}

/// The first second of a device's samples shows how long the loop must wait for them. Meanwhile
/// they wait in the queue; none is lost.
void Pipeline::wait_for_timing() {
  if (parameters_.delay) return;
  const nanoseconds deadline = PeriodicClock::now() + kMeasuring;
  for (const auto& line : probes_) {
    if (!line->probe->is_timed()) continue;
    while (!line->probe->timing() && !line->channel.ended.load(std::memory_order_acquire) &&
           line->channel.delivered.value() < kSampleQueue / 2 &&
           !stop_.load(std::memory_order_relaxed) && PeriodicClock::now() < deadline) {
      std::this_thread::sleep_for(milliseconds{1});
    }
  }
}

nanoseconds Pipeline::measured_delay() const {
  nanoseconds delay{0};
  for (const auto& line : probes_) {
    const ProbeInfo& info = line->probe->info();
    if (info.replayed) continue;
    const auto timing = line->probe->timing();
    if (timing) {
      delay =
          std::max(delay, line->parameters.interpolate ? timing->delay : timing->delay_of_newest);
    } else {
      delay = std::max(delay, 2 * info.period.value_or(kUnknownPeriod));
    }
  }
  return delay;
}

std::vector<RunProgress::OfProbe> Pipeline::readings() const {
  std::vector<RunProgress::OfProbe> readings;
  for (const auto& line : probes_) {
    readings.push_back({.depth_mm = line->channel.depth_mm.load(std::memory_order_relaxed),
                        .force_mN = line->channel.force_mN.load(std::memory_order_relaxed),
                        .channels = line->probe->info().channels,
                        .state = line->channel.state.load(std::memory_order_relaxed)});
  }
  return readings;
}

void Pipeline::drain_events(RunReport& report) {
  if (!parameters_.delay) {
    const std::int64_t delay = measured_delay().count();
    if (delay > delay_ns_.load(std::memory_order_relaxed)) delay_ns_.store(delay);
  }

  LoopEvent event;
  while (events_.try_pop(event)) {
    if (event.kind == LoopEvent::Kind::kRelease) ++report.probes[event.subject].releases;
    if (parameters_.on_event) parameters_.on_event(event);
  }
  for (const auto& line : probes_) {
    for (const std::string& sentence : line->probe->take_notices()) {
      if (parameters_.on_notice) parameters_.on_notice(sentence);
    }
  }
}

template <class C>
void Pipeline::run_loop(C& clock, RunReport& report) {
  constexpr bool kHostTime = std::is_same_v<C, PeriodicClock>;
  wait_for_timing();
  const nanoseconds delay = parameters_.delay.value_or(measured_delay());
  delay_ns_.store(delay.count());
  std::vector<nanoseconds> first_times;
  const bool all_replayed = std::all_of(probes_.begin(), probes_.end(), [](const auto& line) {
    return line->probe->info().replayed;
  });
  std::optional<RecordedRun> recorded;
  for (std::size_t i = 0; i < probes_.size(); ++i) {
    first_times.push_back(*inputs_[i].first_time());
    const auto& run = probes_[i]->probe->info().run;
    if (!all_replayed || !run) continue;
    // A session plays on the ticks of the run that recorded it.
    first_times.back() = run->start;
    if (!recorded) recorded = run;
  }
  // Recordings play from their first sample, whatever its time. With devices, the run starts when
  // the last device has sent a sample.
  const auto [earliest, latest] = std::minmax_element(first_times.begin(), first_times.end());
  HostTimeReport host{.wait = parameters_.wait};
  std::optional<ProcessSetup> process;
  if constexpr (kHostTime) process.emplace(parameters_.realtime, host.rights);
  std::atomic<bool> started{false};
  std::atomic<bool> done{false};
  std::jthread simulation([&, earliest = *earliest, latest = *latest] {
    if constexpr (kHostTime) {
      set_up_simulation_thread(parameters_.realtime, host.rights);
      clock.calibrate();
      rights_ = rights_of_this_thread();
      rights_.cpu_awake = host.rights.cpu_awake ? 1 : 0;
      rights_known_.store(true, std::memory_order_release);
    }
    const nanoseconds now = clock.now();
    report.start = all_replayed ? earliest : std::max(latest, now - delay - kMostBehind);
    // Recordings keep their own time origin; with devices, the origin is the start of the run.
    const ClockPair clocks = read_clock_pair();
    const nanoseconds zero = all_replayed ? nanoseconds{0} : report.start;
    const nanoseconds zero_on_host = all_replayed ? clocks.monotonic - report.start : report.start;
    if (recorded) {
      origin_.set({.start = recorded->zero, .utc = recorded->utc});
    } else {
      origin_.set({.start = zero, .utc = clocks.utc - (clocks.monotonic - zero_on_host)});
    }
    FixedStepLoop<C> loop({.start = report.start,
                           .wall_offset = all_replayed ? now - report.start : nanoseconds{0},
                           .delay = delay,
                           .growing_delay = &delay_ns_,
                           .starts_behind = !all_replayed,
                           .duration = parameters_.duration,
                           .max_catch_up_ticks = parameters_.max_catch_up_ticks.value_or(
                               all_replayed ? INT64_MAX : kLiveCatchUp),
                           .encoder = parameters_.encoder,
                           .timings = parameters_.timings},
                          clock, model_, inputs_, fanout_, statistics_, events_);
    const ThreadUsage before = ThreadUsage::of_this_thread();
    started.store(true, std::memory_order_release);
    const nanoseconds begun = PeriodicClock::now();
    loop.run(stop_);
    report.wall = PeriodicClock::now() - begun;
    host.usage = ThreadUsage::of_this_thread().since(before);
    const auto copy = [](std::span<const std::uint64_t> from, std::vector<std::uint64_t>& to) {
      to.assign(from.begin(), from.end());
    };
    copy(loop.spikes_of_neuron(), report.spikes_of_neuron);
    copy(loop.contact_spikes_of_neuron(), report.contact_spikes_of_neuron);
    copy(loop.contact_ticks_of_patch(), report.contact_ticks_of_patch);
    for (std::size_t i = 0; i < report.probes.size(); ++i) {
      report.probes[i].deepest_press = loop.deepest_press(i);
    }
    done.store(true, std::memory_order_release);
  });
  while (!started.load(std::memory_order_acquire)) std::this_thread::sleep_for(milliseconds{1});
  const nanoseconds wall_start = PeriodicClock::now();
  for (const std::string& sentence : host.rights.missing) {
    if (parameters_.on_missing_right) parameters_.on_missing_right(sentence);
  }
  nanoseconds last_progress = wall_start;
  ProcessorShare share;
  while (!done.load(std::memory_order_acquire)) {
    drain_events(report);
    report_sink_failures();
    std::this_thread::sleep_for(milliseconds{parameters_.fast ? 1 : 20});
    const nanoseconds now = PeriodicClock::now();
    if (kHostTime && !done.load(std::memory_order_acquire) && host.rights.fifo &&
        share.too_large(now, processor_time(simulation.native_handle()))) {
      demote_raised_threads();
    }
    if (parameters_.on_progress && now - last_progress >= kProgressEvery) {
      last_progress = now;
      parameters_.on_progress({.probes = readings(),
                               .wall = now - wall_start,
                               .counters = counters(),
                               .wake_up = statistics_.wake_up.snapshot(),
                               .tick = statistics_.tick.snapshot()});
    }
  }
  simulation.join();
  drain_events(report);
  if constexpr (kHostTime) {
    host.margin = clock.margin();
    host.wake_up = LatencySummary::of(statistics_.wake_up.snapshot());
    if (!all_replayed) {
      host.sample_to_spike = LatencySummary::of(statistics_.sample_to_spike.snapshot());
      host.queue = LatencySummary::of(statistics_.queue.snapshot());
    }
    host.tick = LatencySummary::of(statistics_.tick.snapshot());
    host.publish = LatencySummary::of(statistics_.publish.snapshot());
    report.host_time = std::move(host);
  }
}

Expected<RunReport, SetupError> Pipeline::run() {
  if (auto started = start_probes(); !started) return Unexpected<SetupError>(started.error());
  RunReport report;
  report.probes.resize(probes_.size());
  for (const auto& line : sinks_) {
    line->writer = std::make_unique<SinkWriter>(
        *line->sink, SinkWriter::Sources{.channel = line->channel,
                                         .taps = line->taps,
                                         .frames = line->frames,
                                         .marks = line->marks.get(),
                                         .status = [this] { return status(); },
                                         .origin = &origin_});
  }
  wired_.store(true, std::memory_order_release);
  if (parameters_.fast) {
    VirtualClock clock(stop_);
    run_loop(clock, report);
  } else {
    PeriodicClock clock({.wait = parameters_.wait,
                         .period = model_.parameters().tick,
                         .team = parameters_.team,
                         .beat = &fanout_.beat()});
    run_loop(clock, report);
  }
  finish(report);
  return report;
}

void Pipeline::finish(RunReport& report) {
  report.interrupted = stop_.load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < probes_.size(); ++i) {
    ProbeLine& line = *probes_[i];
    line.reader->stop();
    if (report.error_message.empty()) {
      report.error_message = line.reader->error_message();
      report.bad_input = line.reader->bad_input();
    }
    RunReport::OfProbe& of = report.probes[i];
    of.uri = line.probe->info().uri;
    of.counts = inputs_[i].counts();
    of.device = line.probe->device_counts();
    of.timing = line.probe->timing();
    of.channels = line.probe->info().channels;
    of.stale_after =
        line.parameters.stale_after.value_or(of.timing ? of.timing->stale_after : nanoseconds{0});
    of.dropped = line.channel.dropped.value();
    of.samples_in = line.channel.delivered.value() + of.dropped;
    of.unused = line.channel.delivered.value() - of.counts.used - of.counts.late;
  }
  for (const auto& line : sinks_) {
    for (const auto& tap : line->frames) tap->end();
  }
  static_cast<RunCounters&>(report) = counters();
  report.delay = nanoseconds{delay_ns_.load()};
  report.simulated =
      static_cast<std::int64_t>(report.ticks + report.skipped_ticks) * model_.parameters().tick;
  finish_sinks(report);
}

void Pipeline::finish_sinks(RunReport& report) {
  // All sinks end at the same time; a sink that waits for a peer has until the deadline.
  for (const auto& line : sinks_) line->writer->end(report.error_message.empty());
  const nanoseconds deadline = PeriodicClock::now() + parameters_.ending_patience;
  const auto all_done = [this] {
    return std::all_of(sinks_.begin(), sinks_.end(),
                       [](const auto& line) { return line->writer->done(); });
  };
  while (!all_done() && PeriodicClock::now() < deadline &&
         !hurry_.load(std::memory_order_relaxed)) {
    std::this_thread::sleep_for(milliseconds{1});
  }
  for (const auto& line : sinks_) {
    if (!line->writer->done()) line->writer->give_up();
  }
  for (const auto& line : sinks_) {
    const SinkWriter::Outcome outcome = line->writer->finish();
    report.sinks.push_back({.uri = line->sink->uri(),
                            .spikes_in = line->channel.takes_spikes ? report.spikes : 0,
                            .dropped = line->channel.dropped.value(),
                            .delivered = outcome.delivered,
                            .commands_in = line->channel.commands ? report.commands : 0,
                            .error_message = outcome.error_message});
  }
}

}  // namespace merkel
