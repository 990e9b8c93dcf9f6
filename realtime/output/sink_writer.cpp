#include "realtime/output/sink_writer.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <new>
#include <type_traits>
#include <utility>

#include "realtime/threads/host_time.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {
namespace {

constexpr std::chrono::milliseconds kFlushEvery{200};
constexpr std::size_t kBatch = 1024;

}  // namespace

SinkWriter::SinkWriter(Sink& sink, Sources sources)
    : sink_(sink),
      sources_(std::move(sources)),
      out_of_memory_(sink.uri() +
                     " failed: out of memory: raise the limit of memory (ulimit -v, "
                     "MemoryMax of a service), and run again"),
      thread_([this](const std::stop_token& stop) { write_all(stop); }) {}

void SinkWriter::keep(const Expected<void, SinkError>& result) {
  if (!result) fail(result.error().sentence);
}

void SinkWriter::fail(std::string sentence) noexcept {
  if (!healthy()) return;
  outcome_.error_message = std::move(sentence);
  sources_.channel.commands_failed.store(true, std::memory_order_relaxed);
  failed_.store(true, std::memory_order_release);
}

/// Without memory, only this sink fails.
template <class Work>
void SinkWriter::attempt(const Work& work) {
  try {
    work();
  } catch (const std::bad_alloc&) {
    fail(std::move(out_of_memory_));
  }
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
                  !std::is_same_v<Record, StimulationCommand> &&
                  !std::is_same_v<Record, SentCommand>) {
      for (const auto& feed : of_kind) {
        std::size_t most = kBatch;
        if constexpr (std::is_same_v<Record, SpikeEvent> || std::is_same_v<Record, TaxelBlock> ||
                      std::is_same_v<Record, GivenDrive>) {
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
         .edges = std::exchange(later.edges, {}),
         .spikes = std::exchange(later.spikes, {})});
  for (const auto& feed : feeds.commands) feed->take(waiting_.commands, feed->waiting());
  for (const auto& feed : feeds.sent) feed->take(waiting_.sent, feed->waiting());
  later.commands = waiting_.commands;
  later.sent = leaving();
  write(later);
  if (sink_.interrupted() && outlet_) {
    outlet_->lose();
    refuse(later.sent);
  }
  return count_of(waiting_);
}

/// The commands that the sink gets now.
std::span<const SentCommand> SinkWriter::leaving() {
  if (!outlet_ || waiting_.sent.empty()) return waiting_.sent;
  const auto sent = outlet_->pass(waiting_.sent, host_now());
  refuse(outlet_->refused());
  return sent;
}

void SinkWriter::refuse(std::span<const SentCommand> commands) {
  if (commands.empty()) return;
  sources_.channel.commands_refused.add(commands.size());
  sources_.gate->refuse(commands, sources_.number);
}

/// The gate looks at least once a millisecond, and tells its receivers.
void SinkWriter::wait(std::uint64_t& seen) {
  ConsumerChannel& channel = sources_.channel;
  if (!outlet_ || channel.feed<SentCommand>().ended()) return channel.beat.wait(seen);
  static_cast<void>(channel.new_commands.try_acquire_for(PublishBeat::kMaxWait));
  while (channel.new_commands.try_acquire()) {
  }
}

void SinkWriter::write_status() {
  if (!sink_.takes<RunStatus>()) return;
  RunStatus status = sources_.status();
  const ConsumerChannel& channel = sources_.channel;
  status.losses = {.spikes = channel.dropped<SpikeEvent>(),
                   .ticks = channel.dropped<TickRecord>(),
                   .taxels = channel.dropped<TaxelBlock>() + channel.dropped<TaxelZeros>(),
                   .events = channel.dropped<LoopEvent>(),
                   .samples = channel.dropped<DeliveredSample>(),
                   .edges = channel.dropped<SyncEdge>(),
                   .frames = channel.dropped<PortFrame>(),
                   .commands = channel.dropped<StimulationCommand>() +
                               channel.dropped<SentCommand>() + channel.dropped<GivenDrive>()};
  write({.status = {&status, 1}});
}

bool SinkWriter::all_ended() const {
  const auto ended = [](const auto& feed) { return feed->ended(); };
  const auto& feeds = sources_.channel.feeds;
  return sources_.channel.ended.load(std::memory_order_acquire) &&
         std::all_of(feeds.samples.begin(), feeds.samples.end(), ended) &&
         std::all_of(feeds.edges.begin(), feeds.edges.end(), ended) &&
         std::all_of(feeds.zeros.begin(), feeds.zeros.end(), ended) &&
         std::all_of(feeds.frames.begin(), feeds.frames.end(), ended) &&
         (sources_.gate == nullptr || std::all_of(feeds.sent.begin(), feeds.sent.end(), ended));
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
        attempt([&] { keep(sink_.begin(origin == nullptr ? RunOrigin{} : *origin)); });
      } else {
        sources_.channel.beat.wait(seen);
        continue;
      }
    }
    if (priority_) priority_->check(host_now());
    std::size_t taken = 0;
    attempt([&] { taken = write_waiting(); });
    const auto now = std::chrono::steady_clock::now();
    if (now >= next_flush && healthy()) {
      attempt([&] {
        write_status();
        if (healthy()) keep(sink_.flush());
      });
      next_flush = now + kFlushEvery;
    }
    if (taken > 0) continue;
    if (ended) break;
    wait(seen);
  }
  if (healthy()) attempt([&] { write_status(); });
}

void SinkWriter::write_all(const std::stop_token& stop) {
  set_up_helper_thread("merkel-sink");
  attempt([&] { waiting_.spikes.reserve(kBatch); });
  if (sources_.encoding != nullptr && sources_.channel.takes<SentCommand>() &&
      sink_.receives_commands()) {
    outlet_.emplace(*sources_.encoding);
    priority_.emplace(sources_.realtime, sink_.transport_threads());
  }
  write_until_ended(stop);
  if (outlet_) sources_.gate->end_receiver();
  ending_.wait(Ending::kNotYet, std::memory_order_acquire);
  if (started_) attempt([&] { write_waiting(); });  // marks set after the last item
  const bool complete = ending_.load(std::memory_order_acquire) == Ending::kClose;
  if (healthy()) attempt([&] { keep(complete ? sink_.close() : sink_.flush()); });
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
