#include "realtime/input/probe_reader.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "realtime/threads/host_time.hpp"
#include "realtime/threads/serving_priority.hpp"
namespace merkel {

ProbeReader::ProbeReader(Probe& probe, std::vector<Receivers> receivers, Parameters parameters)
    : probe_(probe),
      receivers_(std::move(receivers)),
      parameters_(parameters),
      thread_([this](const std::stop_token& stop) {
        read_all(stop);
        for (const Receivers& each : receivers_) {
          each.channel->ended.store(true, std::memory_order_release);
          for (auto* const feed : each.feeds) feed->end();
        }
      }) {}

void ProbeReader::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

bool ProbeReader::deliver(ProbeChannel& channel, const ProbeSample& sample,
                          const std::stop_token& stop) {
  const std::span<const float> taxels = probe_.taxels(sample);
  while (!channel.try_push(sample, taxels)) {
    if (!probe_.info().replayed) {
      channel.dropped.add();
      return true;
    }
    if (stop.stop_requested()) return false;
    std::this_thread::sleep_for(std::chrono::microseconds{100});
  }
  channel.delivered.add();
  return true;
}

void ProbeReader::push_to_feed(Feed<DeliveredSample>& feed, const DeliveredSample& item,
                               const std::stop_token& stop) {
  while (!feed.try_push(item)) {
    if (!parameters_.wait_for_sinks || stop.stop_requested()) return feed.drop();
    std::this_thread::sleep_for(std::chrono::microseconds{100});
  }
}

void ProbeReader::read_all(const std::stop_token& stop) {
  set_up_helper_thread("merkel-probe");
  ServingPriority priority(parameters_.realtime);
  std::vector<ProbeSample> samples(1024);
  while (!stop.stop_requested()) {
    priority.check(host_now());
    const auto count = probe_.read(samples, std::chrono::milliseconds{50});
    if (!count) {
      if (count.error() != ProbeError::kEndOfStream) error_message_ = probe_.error_message();
      bad_input_ = count.error() == ProbeError::kBadData;
      return;
    }
    for (std::size_t i = 0; i < *count; ++i) {
      samples[i].time += parameters_.shift;
      samples[i].arrival += parameters_.shift;
      const Receivers& of = receivers_[samples[i].output];
      of.channel->newest_ns.store(std::min(samples[i].time, samples[i].arrival).count(),
                                  std::memory_order_relaxed);
      if (!deliver(*of.channel, samples[i], stop)) return;
      for (auto* const feed : of.feeds) {
        push_to_feed(*feed, {.probe = of.probe, .sample = samples[i]}, stop);
      }
    }
  }
}

}  // namespace merkel
