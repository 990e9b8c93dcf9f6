#include "realtime/sink_lines.hpp"

#include <algorithm>
#include <cstdint>
#include <span>
#include <thread>
#include <utility>

#include "realtime/clocks/periodic_clock.hpp"
#include "realtime/probe_lines.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr std::size_t kSpikeQueue = 65536;
constexpr std::size_t kTickQueue = 16384;
constexpr std::size_t kEventQueue = 1024;

}  // namespace

/// The requests that one sink may make to the run.
class SinkLines::Control final : public RunControl {
 public:
  Control(SinkLines& lines, SpikeChannel& channel) : lines_(lines), channel_(channel) {}

  void watch(std::span<const std::uint32_t> neurons) noexcept override {
    if (!channel_.watched) return;
    for (std::size_t i = 0; i < kMostWatched; ++i) {
      const std::uint32_t number =
          i < neurons.size() && neurons[i] <= lines_.neurons_ ? neurons[i] : 0;
      channel_.watched->neurons[i].store(number, std::memory_order_relaxed);
    }
  }
  [[nodiscard]] bool tare(std::size_t probe) override {
    return started() && probe < lines_.probes_.size() && lines_.probes_.probe(probe).request_tare();
  }
  void mark(const Mark& mark) override {
    if (!started()) return;
    for (const auto& line : lines_.lines_) {
      if (line->marks) line->marks->add(mark);
    }
  }
  [[nodiscard]] Link link(std::size_t probe) const override {
    if (!started()) return Link::kConnected;
    const Probe& queried = lines_.probes_.probe(probe);
    if (queried.info().replayed) return Link::kRecording;
    return queried.connected() ? Link::kConnected : Link::kUnplugged;
  }

 private:
  [[nodiscard]] bool started() const noexcept {
    return lines_.started_.load(std::memory_order_acquire);
  }
  SinkLines& lines_;
  SpikeChannel& channel_;
};

SinkLines::~SinkLines() {
  // Sinks may have threads that use their RunControl until they are destroyed.
  for (const auto& line : lines_) {
    line->writer.reset();
    line->sink.reset();
  }
}

void SinkLines::add(std::unique_ptr<SpikeSink> sink) {
  SpikeChannel& channel = fanout_.add_consumer(kSpikeQueue);
  auto line = std::make_unique<Line>(Line{.control = std::make_unique<Control>(*this, channel),
                                          .sink = std::move(sink),
                                          .channel = channel});
  if (line->wants(SpikeSink::kTicks)) {
    channel.ticks = std::make_unique<CountedQueue<TickRecord>>(kTickQueue);
  }
  if (line->wants(SpikeSink::kEvents)) {
    channel.events = std::make_unique<CountedQueue<LoopEvent>>(kEventQueue);
  }
  if (line->wants(SpikeSink::kStimulation) && commands_) {
    channel.commands = std::make_unique<CountedQueue<StimulationCommand>>(kSpikeQueue);
  }
  if (line->wants(SpikeSink::kNeurons)) channel.watched = std::make_unique<WatchedNeurons>();
  if (line->wants(SpikeSink::kMarks)) line->marks = std::make_unique<MarkBox>();
  channel.takes_spikes = line->sink->takes_spikes();
  line->sink->attach(*line->control);
  lines_.push_back(std::move(line));
}

std::vector<SampleTap*> SinkLines::make_taps(std::size_t capacity) {
  std::vector<SampleTap*> taps;
  for (const auto& line : lines_) {
    if (!line->wants(SpikeSink::kSamples)) continue;
    taps.push_back(line->taps.emplace_back(std::make_unique<SampleTap>(capacity)).get());
  }
  return taps;
}

void SinkLines::listen() {
  for (const auto& line : lines_) {
    if (!line->wants(SpikeSink::kFrames)) continue;
    for (std::size_t i = 0; i < probes_.size(); ++i) {
      Probe& probe = probes_.probe(i);
      for (std::size_t port = 0; port < probe.ports(); ++port) {
        line->frames.push_back(std::make_unique<FrameTap>(probe, i, port));
      }
    }
  }
}

void SinkLines::start(const std::function<RunStatus()>& status, const SharedOrigin& origin) {
  for (const auto& line : lines_) {
    line->writer =
        std::make_unique<SinkWriter>(*line->sink, SinkWriter::Sources{.channel = line->channel,
                                                                      .taps = line->taps,
                                                                      .frames = line->frames,
                                                                      .marks = line->marks.get(),
                                                                      .status = status,
                                                                      .origin = &origin});
  }
  started_.store(true, std::memory_order_release);
}

void SinkLines::report_failures(
    const std::function<void(const std::string&, const std::string&)>& on_failure) {
  for (const auto& line : lines_) {
    if (line->failure_reported) continue;
    const std::string error_message = line->writer->error_message();
    if (error_message.empty()) continue;
    line->failure_reported = true;
    if (on_failure) on_failure(line->sink->uri(), error_message);
  }
}

void SinkLines::finish(RunReport& report, milliseconds patience, const std::atomic<bool>& hurry) {
  for (const auto& line : lines_) {
    for (const auto& tap : line->frames) tap->end();
    line->writer->end(report.error_message.empty());
  }
  const nanoseconds deadline = PeriodicClock::now() + patience;
  const auto all_done = [this] {
    return std::all_of(lines_.begin(), lines_.end(),
                       [](const auto& line) { return line->writer->done(); });
  };
  while (!all_done() && PeriodicClock::now() < deadline && !hurry.load(std::memory_order_relaxed)) {
    std::this_thread::sleep_for(milliseconds{1});
  }
  for (const auto& line : lines_) {
    if (!line->writer->done()) line->writer->give_up();
  }
  for (const auto& line : lines_) {
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
