#include "realtime/pipeline.hpp"

#include <algorithm>
#include <thread>
#include <utility>

#include "core/units.hpp"
#include "realtime/fixed_step_loop.hpp"
#include "realtime/periodic_clock.hpp"
#include "realtime/probe_channel.hpp"
#include "realtime/probe_reader.hpp"
#include "realtime/sink_writer.hpp"
#include "realtime/virtual_clock.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr std::int64_t kLiveCatchUp = 20;
constexpr std::size_t kSampleQueue = 4096;
constexpr std::size_t kLargestSampleQueue = 1'000'000;
constexpr milliseconds kReadAhead{4000};  ///< how far a recording's reader runs ahead
constexpr std::size_t kSpikeQueue = 65536;
constexpr std::size_t kEventQueue = 1024;
constexpr milliseconds kSilence{2000};  ///< a device that sends nothing for so long is refused
constexpr nanoseconds kUnknownPeriod{1'000'000};

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
  std::unique_ptr<SpikeSink> sink;
  SpikeChannel& channel;
  std::unique_ptr<SinkWriter> writer;
};

bool RunReport::complete() const {
  return trouble.empty() && std::all_of(sinks.begin(), sinks.end(), [](const OfSink& sink) {
           return sink.trouble.empty() && sink.delivered == sink.spikes_in;
         });
}

Pipeline::Pipeline(TactileModel& model, Parameters parameters)
    : model_(model), parameters_(std::move(parameters)), events_(kEventQueue) {}

Pipeline::~Pipeline() = default;

void Pipeline::add_probe(std::unique_ptr<Probe> probe, const ProbeInput::Parameters& parameters) {
  probes_.push_back(std::make_unique<ProbeLine>(std::move(probe), parameters));
}

void Pipeline::add_sink(std::unique_ptr<SpikeSink> sink) {
  SpikeChannel& channel = fanout_.add_consumer(kSpikeQueue);
  sinks_.push_back(std::make_unique<SinkLine>(SinkLine{std::move(sink), channel, nullptr}));
}

SpikeChannel& Pipeline::add_consumer(std::size_t capacity) {
  return fanout_.add_consumer(capacity);
}

Expected<void, SetupError> Pipeline::start_probes() {
  if (probes_.size() != model_.indenters()) {
    return bad_input("the scene has " + std::to_string(model_.indenters()) + " indenters, but " +
                     std::to_string(probes_.size()) +
                     " probes were given: give one probe an indenter");
  }
  const bool all_replayed = std::all_of(probes_.begin(), probes_.end(), [](const auto& line) {
    return line->probe->info().replayed;
  });
  if (parameters_.fast && !all_replayed) {
    return bad_input("a device cannot be read faster than real time: leave out --fast");
  }
  for (const auto& line : probes_) {
    // Among devices, a recording plays as if it were taken now.
    const nanoseconds shift =
        line->probe->info().replayed && !all_replayed ? PeriodicClock().now() : nanoseconds{0};
    inputs_.emplace_back(line->channel, line->parameters);
    line->reader = std::make_unique<ProbeReader>(*line->probe, line->channel, shift);
  }
  return wait_for_first_samples();
}

Expected<void, SetupError> Pipeline::wait_for_first_samples() {
  PeriodicClock clock;
  const nanoseconds deadline = clock.now() + kSilence;
  for (std::size_t i = 0; i < probes_.size(); ++i) {
    const ProbeChannel& channel = probes_[i]->channel;
    // A recording starts with its queue well filled, so that none of its samples will be late.
    const std::uint64_t wanted = probes_[i]->probe->info().replayed ? kSampleQueue / 2 : 1;
    while (channel.delivered.value() < wanted && !channel.ended.load(std::memory_order_acquire) &&
           !stop_.load(std::memory_order_relaxed)) {
      if (clock.now() > deadline) {
        return bad_input("the probe " + probes_[i]->probe->info().uri + " has sent nothing for " +
                         std::to_string(kSilence.count() / 1000) +
                         " s: check that it is switched on and streaming");
      }
      std::this_thread::sleep_for(milliseconds{1});
    }
  }
  for (std::size_t i = 0; i < probes_.size(); ++i) {
    if (inputs_[i].first_time()) continue;
    probes_[i]->reader->stop();
    const std::string& trouble = probes_[i]->reader->trouble();
    return bad_input(trouble.empty() ? "the probe " + probes_[i]->probe->info().uri +
                                           " gave no samples: nothing can be simulated"
                                     : trouble);
  }
  return {};
}

void Pipeline::drain_events(RunReport& report) {
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
  nanoseconds delay = parameters_.delay.value_or(nanoseconds{0});
  std::vector<nanoseconds> first_times;
  bool all_replayed = true;
  for (std::size_t i = 0; i < probes_.size(); ++i) {
    const ProbeInfo& info = probes_[i]->probe->info();
    if (!parameters_.delay) delay = std::max(delay, 2 * info.period.value_or(kUnknownPeriod));
    first_times.push_back(*inputs_[i].first_time());
    all_replayed = all_replayed && info.replayed;
  }
  // Recordings are played from their first sample, at whatever time they were made; with devices,
  // the run starts when the last of them speaks.
  const auto [earliest, latest] = std::minmax_element(first_times.begin(), first_times.end());
  report.start = all_replayed ? *earliest : *latest;
  const nanoseconds wall_start = clock.now();
  FixedStepLoop<C> loop({.start = report.start,
                         .wall_offset = all_replayed ? wall_start - report.start : nanoseconds{0},
                         .delay = delay,
                         .duration = parameters_.duration,
                         .max_catch_up_ticks = parameters_.max_catch_up_ticks.value_or(
                             all_replayed ? INT64_MAX : kLiveCatchUp)},
                        clock, model_, inputs_, fanout_, statistics_, events_);
  std::atomic<bool> done{false};
  const auto begun = std::chrono::steady_clock::now();
  std::jthread simulation([&] {
    loop.run(stop_);
    done.store(true, std::memory_order_release);
  });
  while (!done.load(std::memory_order_acquire)) {
    drain_events(report);
    std::this_thread::sleep_for(milliseconds{parameters_.fast ? 1 : 20});
  }
  simulation.join();
  report.wall = std::chrono::steady_clock::now() - begun;
  drain_events(report);
  report.spikes_of_neuron.assign(loop.spikes_of_neuron().begin(), loop.spikes_of_neuron().end());
}

Expected<RunReport, SetupError> Pipeline::run() {
  if (auto started = start_probes(); !started) return Unexpected<SetupError>(started.error());
  RunReport report;
  report.probes.resize(probes_.size());
  for (const auto& line : sinks_) {
    line->writer = std::make_unique<SinkWriter>(*line->sink, line->channel);
  }
  if (parameters_.fast) {
    VirtualClock clock;
    run_loop(clock, report);
  } else {
    PeriodicClock clock;
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
    if (report.trouble.empty()) report.trouble = line.reader->trouble();
    RunReport::OfProbe& of = report.probes[i];
    of.uri = line.probe->info().uri;
    of.counts = inputs_[i].counts();
    of.device = line.probe->device_counts();
    of.dropped = line.channel.dropped.value();
    of.samples_in = line.channel.delivered.value() + of.dropped;
    of.unused = line.channel.delivered.value() - of.counts.used - of.counts.late;
  }
  report.ticks = statistics_.ticks.value();
  report.overruns = statistics_.overruns.value();
  report.longest_overrun =
      nanoseconds{static_cast<std::int64_t>(statistics_.longest_overrun_ns.value())};
  report.catch_up_ticks = statistics_.catch_up_ticks.value();
  report.gaps = statistics_.gaps.value();
  report.skipped_ticks = statistics_.skipped_ticks.value();
  report.neuron_resets = statistics_.neuron_resets.value();
  report.spikes = statistics_.spikes.value();
  report.simulated =
      static_cast<std::int64_t>(report.ticks + report.skipped_ticks) * model_.parameters().tick;
  for (const auto& line : sinks_) {
    const SinkWriter::Outcome outcome = line->writer->finish(report.trouble.empty());
    report.sinks.push_back({.uri = line->sink->uri(),
                            .spikes_in = report.spikes,
                            .dropped = line->channel.dropped.value(),
                            .delivered = outcome.delivered,
                            .trouble = outcome.trouble});
  }
}

}  // namespace merkel
