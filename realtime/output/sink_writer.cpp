#include "realtime/output/sink_writer.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <utility>

#include "realtime/threads/thread_setup.hpp"

namespace merkel {
namespace {

constexpr std::chrono::milliseconds kFlushEvery{200};
constexpr std::size_t kBatch = 1024;
constexpr std::chrono::milliseconds kWatchEvery{1};

/// Moves the waiting items of a queue into `batch`, at most kBatch items.
template <class T>
void take(BoundedQueue<T>& queue, std::vector<T>& batch) {
  batch.clear();
  T item;
  while (batch.size() < kBatch && queue.try_pop(item)) batch.push_back(item);
}

}  // namespace

SinkWriter::SinkWriter(SpikeSink& sink, Sources sources)
    : sink_(sink), sources_(std::move(sources)), thread_([this] { write_all(); }) {}

void SinkWriter::keep(const Expected<void, SinkError>& result) {
  if (result || !healthy()) return;
  outcome_.error_message = result.error().sentence;
  sources_.channel.commands_failed.store(true, std::memory_order_relaxed);
  failed_.store(true, std::memory_order_release);
}

/// Writes at least the items that are in the queues now.
template <class T>
std::size_t SinkWriter::write_waiting(
    BoundedQueue<T>& queue, std::vector<T>& batch,
    Expected<void, SinkError> (SpikeSink::*write)(std::span<const T>)) {
  const std::size_t waiting = queue.size_approx();
  std::size_t taken = 0;
  do {
    take(queue, batch);
    taken += batch.size();
    if (!batch.empty() && healthy()) keep((sink_.*write)(batch));
  } while (!batch.empty() && taken < waiting);
  return taken;
}

std::size_t SinkWriter::write_ticks_and_output() {
  // Ticks are taken first and written last. The loop publishes a tick's spikes and commands before
  // its record, so those of the taken ticks are already in the queues, and later items need not be
  // taken.
  SpikeChannel& channel = sources_.channel;
  ticks_.clear();
  if (channel.ticks) take(channel.ticks->items, ticks_);
  const std::size_t spikes = write_waiting(channel.spikes, spikes_, &SpikeSink::write);
  outcome_.taken += spikes;
  const std::size_t commands = write_commands();
  if (!ticks_.empty() && healthy()) keep(sink_.write_ticks(ticks_));
  return spikes + commands + ticks_.size();
}

std::size_t SinkWriter::write_commands() {
  if (gate_) return pass_commands();
  if (!sources_.channel.commands) return 0;
  return write_waiting(sources_.channel.commands->items, commands_, &SpikeSink::write_commands);
}

/// Writes what the gate lets through, also if nothing waits: the gate is the watchdog.
std::size_t SinkWriter::pass_commands() {
  SpikeChannel& channel = sources_.channel;
  std::size_t taken = 0;
  do {
    take(channel.commands->items, commands_);
    taken += commands_.size();
    const auto before = gate_->counts();
    const auto leaving = gate_->pass(commands_, sources_.watch->moment(newest_));
    channel.commands_withheld.add(gate_->counts().withheld - before.withheld);
    channel.commands_slowed.add(gate_->counts().slowed - before.slowed);
    channel.stale_stops.add(gate_->counts().stale - before.stale);
    if (!leaving.empty() && healthy()) keep(sink_.write_commands(leaving));
  } while (!commands_.empty());
  return taken;
}

std::size_t SinkWriter::write_samples() {
  std::size_t taken = 0;
  for (std::size_t probe = 0; probe < sources_.taps.size(); ++probe) {
    take(sources_.taps[probe]->queue.items, samples_);
    taken += samples_.size();
    if (!samples_.empty() && healthy()) keep(sink_.write_samples(probe, samples_));
  }
  return taken;
}

std::size_t SinkWriter::write_frames() {
  std::size_t taken = 0;
  for (const auto& tap : sources_.frames) {
    take(tap->queue.items, frames_);
    taken += frames_.size();
    if (!frames_.empty() && healthy()) {
      keep(sink_.write_frames(tap->probe(), tap->port(), frames_));
    }
  }
  return taken;
}

std::size_t SinkWriter::write_events() {
  if (!sources_.channel.events) return 0;
  take(sources_.channel.events->items, events_);
  if (!events_.empty() && healthy()) keep(sink_.write_events(events_));
  return events_.size();
}

std::size_t SinkWriter::write_neurons() {
  if (!sources_.channel.watched) return 0;
  take(sources_.channel.watched->samples.items, neurons_);
  if (!neurons_.empty() && healthy()) keep(sink_.write_neurons(neurons_));
  return neurons_.size();
}

void SinkWriter::write_marks() {
  if (sources_.marks == nullptr) return;
  const std::vector<Mark> marks = sources_.marks->take();
  if (!marks.empty() && healthy()) keep(sink_.write_marks(marks));
}

void SinkWriter::write_status() {
  if ((sink_.subscriptions() & SpikeSink::kStatus) == 0U) return;
  RunStatus status = sources_.status();
  const SpikeChannel& channel = sources_.channel;
  status.losses.spikes = channel.dropped.value();
  if (channel.ticks) status.losses.ticks = channel.ticks->dropped.value();
  if (channel.events) status.losses.events = channel.events->dropped.value();
  if (channel.commands) status.losses.commands = channel.commands->dropped.value();
  for (const auto& tap : sources_.taps) status.losses.samples += tap->queue.dropped.value();
  for (const auto& tap : sources_.frames) status.losses.frames += tap->queue.dropped.value();
  keep(sink_.write_status(status));
}

bool SinkWriter::all_ended() const {
  const auto ended = [](const auto& tap) { return tap->ended.load(std::memory_order_acquire); };
  return sources_.channel.ended.load(std::memory_order_acquire) &&
         std::all_of(sources_.taps.begin(), sources_.taps.end(), ended) &&
         std::all_of(sources_.frames.begin(), sources_.frames.end(), ended);
}

void SinkWriter::write_until_ended() {
  std::uint64_t seen = 0;
  auto next_flush = std::chrono::steady_clock::now() + kFlushEvery;
  for (;;) {
    // Read the flags before the queues: they are set after the last item.
    const bool ended = all_ended();
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
    std::size_t taken = write_frames();
    taken += write_samples();
    taken += write_ticks_and_output();
    taken += write_events();
    taken += write_neurons();
    write_marks();
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

void SinkWriter::write_all() {
  set_up_helper_thread("merkel-sink");
  spikes_.reserve(kBatch);
  const RunWatch* const watch = sources_.watch;
  if (watch != nullptr && watch->guarded() && sources_.channel.commands && sink_.stimulates()) {
    gate_.emplace(watch->make_gate());
    newest_.resize(watch->patches());
  }
  write_until_ended();
  ending_.wait(Ending::kNotYet, std::memory_order_acquire);
  if (started_) write_marks();  // those set after the last item
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
