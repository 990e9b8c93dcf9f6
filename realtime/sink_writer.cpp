#include "realtime/sink_writer.hpp"

#include <chrono>
#include <vector>

#include "realtime/thread_setup.hpp"

namespace merkel {
namespace {

constexpr std::chrono::milliseconds kFlushEvery{200};

}  // namespace

SinkWriter::SinkWriter(SpikeSink& sink, SpikeChannel& channel)
    : sink_(sink), channel_(channel), thread_([this] { write_all(); }) {}

void SinkWriter::write_all() {
  set_up_helper_thread("merkel-sink");
  std::vector<SpikeEvent> batch;
  batch.reserve(1024);
  std::uint64_t seen = 0;
  auto next_flush = std::chrono::steady_clock::now() + kFlushEvery;
  const auto keep = [this](const Expected<void, SinkError>& result) {
    if (!result && outcome_.trouble.empty()) outcome_.trouble = result.error().sentence;
  };
  for (;;) {
    // Read the flag before the queue: it is set after the last spike.
    const bool ended = channel_.ended.load(std::memory_order_acquire);
    batch.clear();
    SpikeEvent spike;
    while (batch.size() < batch.capacity() && channel_.spikes.try_pop(spike)) {
      batch.push_back(spike);
    }
    outcome_.taken += batch.size();
    if (!batch.empty() && outcome_.trouble.empty()) keep(sink_.write(batch));
    const auto now = std::chrono::steady_clock::now();
    if (now >= next_flush && outcome_.trouble.empty()) {
      keep(sink_.flush());
      next_flush = now + kFlushEvery;
    }
    if (!batch.empty()) continue;
    if (ended) return;
    channel_.beat.wait(seen);
  }
}

SinkWriter::Outcome SinkWriter::finish(bool complete) {
  if (thread_.joinable()) thread_.join();
  if (outcome_.trouble.empty()) {
    const auto closed = complete ? sink_.close() : sink_.flush();
    if (!closed) outcome_.trouble = closed.error().sentence;
  }
  outcome_.delivered = sink_.delivered();
  return outcome_;
}

}  // namespace merkel
