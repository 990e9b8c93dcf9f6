#include "realtime/run_sinks.hpp"

#include <algorithm>
#include <cstdint>
#include <span>
#include <thread>
#include <type_traits>
#include <utility>

#include "realtime/clocks/periodic_clock.hpp"
#include "realtime/run_probes.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

template <class Record, class... Others>
constexpr bool kIsOneOf = (std::is_same_v<Record, Others> || ...);

/// How many records of a kind that the loop produces may wait for a sink. Some have a feed from
/// each probe, each port and each device; for the status, the sink's thread asks.
template <class Record>
constexpr std::size_t kCapacity =
    kIsOneOf<Record, DeliveredSample, PortFrame, SyncEdge, TaxelZeros, RunStatus> ? 0
    : kIsOneOf<Record, SpikeEvent, StimulationCommand, SentCommand, TaxelBlock>   ? 65536
                                                                                  : 16384;

}  // namespace

/// The requests that one sink may make to the run.
class RunSinks::Control final : public RunControl {
 public:
  Control(RunSinks& sinks, ConsumerChannel& channel) : sinks_(sinks), channel_(channel) {}

  void watch(std::span<const std::uint32_t> neurons) noexcept override {
    for (std::size_t i = 0; i < kMaxWatched; ++i) {
      const std::uint32_t number =
          i < neurons.size() && neurons[i] <= sinks_.run_.neurons ? neurons[i] : 0;
      channel_.watched[i].store(number, std::memory_order_relaxed);
    }
  }
  [[nodiscard]] bool tare(std::size_t probe) override {
    const RunProbes& probes = sinks_.probes_;
    return started() && probe < probes.size() &&
           probes.device_of(probe).request_tare(probes.output_of(probe));
  }
  void mark(const Mark& mark) override {
    if (started()) sinks_.mark(mark);
  }
  void notice(const std::string& sentence) override {
    const std::lock_guard lock(sinks_.mutex_);
    sinks_.notices_.push_back(sentence);
  }
  [[nodiscard]] StimulationSwitch& stimulation() noexcept override {
    return sinks_.watch_.stimulation();
  }
  [[nodiscard]] Link link(std::size_t probe) const override {
    if (!started()) return Link::kConnected;
    const Probe& queried = sinks_.probes_.device_of(probe);
    if (queried.info().replayed) return Link::kRecording;
    return queried.status().connected ? Link::kConnected : Link::kUnplugged;
  }

 private:
  [[nodiscard]] bool started() const noexcept {
    return sinks_.started_.load(std::memory_order_acquire);
  }
  RunSinks& sinks_;
  ConsumerChannel& channel_;
};

RunSinks::~RunSinks() {
  // Sinks may have threads that use their RunControl until they are destroyed.
  for (const auto& entry : entries_) {
    entry->writer.reset();
    entry->sink.reset();
  }
}

template <class Record>
bool RunSinks::is_produced(const Sink& sink) const noexcept {
  if constexpr (std::is_same_v<Record, StimulationCommand>) return run_.commands;
  // On a virtual clock nothing is sent, so there is nothing to record.
  if constexpr (std::is_same_v<Record, SentCommand>) {
    return run_.commands && (sink.receives_commands() || !run_.fast);
  }
  if constexpr (std::is_same_v<Record, GivenDrive>) return run_.commands;
  return run_.arrays || !std::is_same_v<Record, TaxelBlock>;
}

void RunSinks::add(std::unique_ptr<Sink> sink) {
  ConsumerChannel& channel = fanout_.add_channel();
  for_each_kind(channel.feeds, [&]<class Record>(const Feeds<Record>&) {
    const bool produced = is_produced<Record>(*sink);
    constexpr std::size_t kRoom = kCapacity<Record>;
    if constexpr (kRoom > 0) {
      if (produced && sink->takes<Record>()) channel.add<Record>(kRoom);
    }
  });
  auto entry = std::make_unique<Entry>(Entry{.control = std::make_unique<Control>(*this, channel),
                                             .sink = std::move(sink),
                                             .channel = channel});
  entry->sink->attach(*entry->control);
  // On a virtual clock no receiver acts on commands.
  if (!gate_ && run_.commands && !run_.fast && entry->sink->receives_commands()) {
    gate_ = std::make_unique<GateThread>(fanout_, watch_);
  }
  entries_.push_back(std::move(entry));
}

std::vector<Feed<DeliveredSample>*> RunSinks::add_sample_feeds(std::size_t capacity,
                                                               std::uint32_t probe,
                                                               const ProbeColumns& columns) {
  std::vector<Feed<DeliveredSample>*> feeds;
  for (const auto& entry : entries_) {
    if (!entry->sink->takes<DeliveredSample>()) continue;
    feeds.push_back(&entry->channel.add<DeliveredSample>(capacity, probe, columns));
  }
  return feeds;
}

void RunSinks::listen() {
  constexpr std::size_t kEdges = 4096;
  constexpr std::size_t kZeros = 4096;
  for (const auto& entry : entries_) {
    for (std::uint32_t i = 0; i < probes_.size(); ++i) {
      if (!probes_.is_first_of_device(i)) continue;
      if (entry->sink->takes<SyncEdge>()) {
        probes_.feeds_of(i).edges.push_back(&entry->channel.add<SyncEdge>(kEdges));
      }
      if (run_.arrays && entry->sink->takes<TaxelZeros>()) {
        probes_.feeds_of(i).zeros.push_back(&entry->channel.add<TaxelZeros>(kZeros));
      }
      if (!entry->sink->takes<PortFrame>()) continue;
      Probe& probe = probes_.device_of(i);
      for (std::uint32_t port = 0; port < probe.ports(); ++port) {
        entry->taps.push_back(std::make_unique<FrameTap>(
            probe, i, port, entry->channel.add<PortFrame>(FrameTap::kCapacity)));
      }
    }
  }
}

void RunSinks::start(const std::function<RunStatus()>& status, const SharedOrigin& origin,
                     const RealtimeSettings& realtime) {
  if (gate_) {
    for (const auto& entry : entries_) {
      if (!entry->channel.template takes<SentCommand>()) continue;
      gate_->add(entry->channel, !entry->sink->receives_commands());
    }
    gate_->start(realtime);
  }
  std::uint32_t number = 0;
  for (const auto& entry : entries_) {
    entry->writer = std::make_unique<SinkWriter>(
        *entry->sink, SinkWriter::Sources{.channel = entry->channel,
                                          .status = status,
                                          .origin = &origin,
                                          .encoding = gate_ ? &watch_.encoding() : nullptr,
                                          .gate = gate_.get(),
                                          .number = ++number,
                                          .realtime = realtime});
  }
  started_.store(true, std::memory_order_release);
}

void RunSinks::take_notices(const std::function<void(const std::string&)>& on_notice) {
  std::vector<std::string> notices;
  {
    const std::lock_guard lock(mutex_);
    notices = std::exchange(notices_, {});
  }
  for (const std::string& sentence : notices) {
    if (on_notice) on_notice(sentence);
  }
}

void RunSinks::mark(const Mark& mark) {
  for (const auto& entry : entries_) {
    for (const auto& feed : entry->channel.feeds.marks) static_cast<void>(feed->try_push(mark));
  }
}

void RunSinks::report_failures(
    const std::function<void(const std::string&, const std::string&)>& on_failure) {
  for (const auto& entry : entries_) {
    if (entry->failure_reported) continue;
    const std::string error_message = entry->writer->error_message();
    if (error_message.empty()) continue;
    entry->failure_reported = true;
    if (on_failure) on_failure(entry->sink->uri(), error_message);
  }
}

void RunSinks::finish(RunReport& report, milliseconds patience, const std::atomic<bool>& end_now) {
  for (const auto& entry : entries_) {
    for (const auto& tap : entry->taps) tap->end();
    entry->writer->end(report.error_message.empty());
  }
  const nanoseconds deadline = PeriodicClock::now() + patience;
  const auto all_done = [this] {
    return std::all_of(entries_.begin(), entries_.end(),
                       [](const auto& entry) { return entry->writer->done(); });
  };
  while (!all_done() && PeriodicClock::now() < deadline &&
         !end_now.load(std::memory_order_relaxed)) {
    std::this_thread::sleep_for(std::chrono::microseconds{100});
  }
  for (const auto& entry : entries_) {
    if (!entry->writer->done()) entry->writer->give_up();
  }
  for (const auto& entry : entries_) {
    const SinkWriter::Outcome outcome = entry->writer->finish();
    report.sinks.push_back({.uri = entry->sink->uri(),
                            .spikes_in = entry->channel.takes<SpikeEvent>() ? report.spikes : 0,
                            .dropped = entry->channel.dropped<SpikeEvent>(),
                            .delivered = outcome.delivered,
                            .commands_in = entry->channel.takes<StimulationCommand>() ||
                                                   entry->channel.takes<SentCommand>()
                                               ? report.commands
                                               : 0,
                            .commands_refused = entry->channel.commands_refused.value(),
                            .error_message = outcome.error_message});
  }
}

}  // namespace merkel
