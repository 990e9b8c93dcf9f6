#include "realtime/output/sink_writer.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "realtime/threads/host_time.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {
namespace {

constexpr std::chrono::milliseconds kFlushEvery{200};
constexpr std::size_t kBatch = 1024;
constexpr std::chrono::milliseconds kWatchEvery{1};

}  // namespace

SinkWriter::SinkWriter(Sink& sink, Sources sources)
    : sink_(sink),
      sources_(std::move(sources)),
      thread_([this](const std::stop_token& stop) { write_all(stop); }) {}

void SinkWriter::keep(const Expected<void, SinkError>& result) {
  if (result || !healthy()) return;
  outcome_.error_message = result.error().sentence;
  sources_.channel.commands_failed.store(true, std::memory_order_relaxed);
  failed_.store(true, std::memory_order_release);
}

void SinkWriter::write(const RecordBatch& batch) {
  if (count_of(batch) > 0 && healthy()) keep(sink_.write(batch));
}

/// Writes what waits in the feeds. \return the number of records taken
std::size_t SinkWriter::write_waiting() {
  // Ticks are taken first and written last. The loop publishes a tick's spikes, commands and taxels
  // before its record, so those of the taken ticks are already in their feeds, and all of them are
  // taken.
  const auto& feeds = sources_.channel.feeds;
  clear_all(waiting_);
  for (const auto& feed : feeds.ticks) feed->take(waiting_.ticks, kBatch);
  for_each_kind(feeds, [this]<class Record>(const Feeds<Record>& of_kind) {
    if constexpr (!std::is_same_v<Record, TickRecord> &&
                  !std::is_same_v<Record, StimulationCommand>) {
      for (const auto& feed : of_kind) {
        std::size_t most = kBatch;
        if constexpr (std::is_same_v<Record, SpikeEvent> || std::is_same_v<Record, TaxelBlock>) {
          most = feed->waiting();
        }
        feed->take(waiting_.of<Record>(), most);
      }
    }
  });
  outcome_.taken += waiting_.spikes.size();
  RecordBatch later = batch_of(waiting_);
  write({.frames = std::exchange(later.frames, {}),
         .samples = std::exchange(later.samples, {}),
         .spikes = std::exchange(later.spikes, {})});
  for (const auto& feed : feeds.commands) feed->take(waiting_.commands, feed->waiting());
  later.commands = leaving();
  write(later);
  return count_of(waiting_);
}

/// The commands that may leave now. The gate is asked also if none waits: it is the watchdog.
std::span<const StimulationCommand> SinkWriter::leaving() {
  if (!gate_) return waiting_.commands;
  ConsumerChannel& channel = sources_.channel;
  const auto before = gate_->counts();
  const auto commands = gate_->pass(waiting_.commands, sources_.watch->moment(newest_));
  channel.commands_withheld.add(gate_->counts().withheld - before.withheld);
  channel.commands_slowed.add(gate_->counts().slowed - before.slowed);
  channel.stale_stops.add(gate_->counts().stale - before.stale);
  return commands;
}

void SinkWriter::write_status() {
  if (!sink_.takes<RunStatus>()) return;
  RunStatus status = sources_.status();
  const ConsumerChannel& channel = sources_.channel;
  status.losses = {.spikes = channel.dropped<SpikeEvent>(),
                   .ticks = channel.dropped<TickRecord>(),
                   .taxels = channel.dropped<TaxelBlock>(),
                   .events = channel.dropped<LoopEvent>(),
                   .samples = channel.dropped<DeliveredSample>(),
                   .frames = channel.dropped<PortFrame>(),
                   .commands = channel.dropped<StimulationCommand>()};
  write({.status = {&status, 1}});
}

bool SinkWriter::all_ended() const {
  const auto ended = [](const auto& feed) { return feed->ended(); };
  const auto& samples = sources_.channel.feeds.samples;
  const auto& frames = sources_.channel.feeds.frames;
  return sources_.channel.ended.load(std::memory_order_acquire) &&
         std::all_of(samples.begin(), samples.end(), ended) &&
         std::all_of(frames.begin(), frames.end(), ended);
}

void SinkWriter::write_until_ended(const std::stop_token& stop) {
  std::uint64_t seen = 0;
  auto next_flush = std::chrono::steady_clock::now() + kFlushEvery;
  for (;;) {
    // Read the flags before the queues: they are set after the last item.
    const bool ended = all_ended() || stop.stop_requested();
    if (!started_) {
      const RunOrigin* const origin = sources_.origin == nullptr ? nullptr : sources_.origin->get();
      if (sources_.origin == nullptr || origin != nullptr || ended) {
        started_ = true;
        keep(sink_.begin(origin == nullptr ? RunOrigin{} : *origin));
      } else {
        sources_.channel.beat.wait(seen);
        continue;
      }
    }
    if (priority_) priority_->check(host_now());
    const std::size_t taken = write_waiting();
    const auto now = std::chrono::steady_clock::now();
    if (now >= next_flush && healthy()) {
      write_status();
      if (healthy()) keep(sink_.flush());
      next_flush = now + kFlushEvery;
    }
    if (taken > 0) continue;
    if (ended) break;
    sources_.channel.beat.wait(seen, gate_ ? kWatchEvery : PublishBeat::kLongestWait);
  }
  if (healthy()) write_status();
}

void SinkWriter::write_all(const std::stop_token& stop) {
  set_up_helper_thread("merkel-sink");
  waiting_.spikes.reserve(kBatch);
  const RunWatch* const watch = sources_.watch;
  if (watch != nullptr && watch->guarded() && sources_.channel.takes<StimulationCommand>() &&
      sink_.stimulates()) {
    gate_.emplace(watch->make_gate());
    newest_.resize(watch->patches());
  }
  if (gate_) priority_.emplace(sources_.realtime, sink_.transport_threads());
  write_until_ended(stop);
  ending_.wait(Ending::kNotYet, std::memory_order_acquire);
  if (started_) write_waiting();  // marks set after the last item
  const bool complete = ending_.load(std::memory_order_acquire) == Ending::kClose;
  if (healthy()) keep(complete ? sink_.close() : sink_.flush());
  outcome_.delivered = sink_.delivered();
  done_.store(true, std::memory_order_release);
}

void SinkWriter::end(bool complete) noexcept {
  Ending not_yet = Ending::kNotYet;
  ending_.compare_exchange_strong(not_yet, complete ? Ending::kClose : Ending::kAbandon);
  ending_.notify_all();
}

SinkWriter::Outcome SinkWriter::finish() {
  if (thread_.joinable()) thread_.join();
  return outcome_;
}

SinkWriter::~SinkWriter() { end(false); }

}  // namespace merkel
