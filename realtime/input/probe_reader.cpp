#include "realtime/input/probe_reader.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "realtime/threads/host_time.hpp"
#include "realtime/threads/serving_priority.hpp"
namespace merkel {

ProbeReader::ProbeReader(Probe& probe, std::vector<Receivers> receivers, DeviceFeeds feeds,
                         Parameters parameters)
    : probe_(probe),
      receivers_(std::move(receivers)),
      feeds_(std::move(feeds)),
      parameters_(parameters),
      thread_([this](const std::stop_token& stop) {
        read_all(stop);
        for (auto* const feed : feeds_.edges) feed->end();
        for (auto* const feed : feeds_.zeros) feed->end();
        for (const Receivers& each : receivers_) {
          each.channel->ended.store(true, std::memory_order_release);
          for (auto* const feed : each.feeds) feed->end();
        }
      }) {}

void ProbeReader::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

bool ProbeReader::deliver(const ReadingHead& head, std::span<const double> row,
                          const std::stop_token& stop) {
  ReadingRing& ring = *receivers_.front().channel->ring;
  bool pushed = ring.try_push(head, row);
  while (!pushed && probe_.info().replayed) {
    if (stop.stop_requested()) return false;
    std::this_thread::sleep_for(std::chrono::microseconds{100});
    pushed = ring.try_push(head, row);
  }
  for (const Receivers& each : receivers_) {
    ProbeQueue& channel = *each.channel;
    if (channel.columns().measured_in(row)) (pushed ? channel.delivered : channel.dropped).add();
  }
  return true;
}

void ProbeReader::push_to_feeds(const ReadingHead& head, std::span<const double> row,
                                const std::stop_token& stop) {
  for (const Receivers& each : receivers_) {
    const ProbeColumns& columns = each.channel->columns();
    if (!columns.measured_in(row)) continue;
    for (auto* const feed : each.feeds) push(*feed, stop, head, row.subspan(columns.first));
  }
}

void ProbeReader::push_beside(Readings& readings, const std::stop_token& stop) {
  readings.shift_beside(parameters_.shift);
  for (SyncEdge& edge : readings.edges()) {
    edge.probe = receivers_.front().probe;
    for (auto* const feed : feeds_.edges) push(*feed, stop, edge);
  }
  for (TaxelZeros& zeros : readings.zeros()) {
    zeros.probe = receivers_[zeros.probe].probe;
    for (auto* const feed : feeds_.zeros) push(*feed, stop, zeros);
  }
}

template <class... Record>
void ProbeReader::push(auto& feed, const std::stop_token& stop, const Record&... record) {
  while (!feed.try_push(record...)) {
    if (!parameters_.wait_for_sinks || stop.stop_requested()) {
      feed.drop();
      return;
    }
    std::this_thread::sleep_for(std::chrono::microseconds{100});
  }
}

void ProbeReader::read_all(const std::stop_token& stop) {
  set_up_helper_thread("merkel-probe");
  ServingPriority priority(parameters_.realtime);
  Readings readings = probe_.readings();
  while (!stop.stop_requested()) {
    priority.check(host_now());
    const auto count = probe_.read(readings, std::chrono::milliseconds{50});
    if (!count) {
      if (count.error() != ProbeError::kEndOfStream) error_message_ = probe_.error_message();
      bad_input_ = count.error() == ProbeError::kBadData;
      return;
    }
    push_beside(readings, stop);
    for (std::size_t i = 0; i < readings.size(); ++i) {
      ReadingHead& head = readings.head(i);
      const std::span<double> row = readings.row(i);
      head.time += parameters_.shift;
      head.arrival += parameters_.shift;
      for (const Receivers& each : receivers_) {
        const ProbeColumns& columns = each.channel->columns();
        if (!columns.measured_in(row)) continue;
        if (each.contact != nullptr) {
          ProbeSample sample = columns.sample(head, row);
          each.contact->decide(sample);
          columns.put(sample, row);
        }
        each.channel->newest_ns.store(std::min(head.time, head.arrival).count(),
                                      std::memory_order_relaxed);
      }
      if (!deliver(head, row, stop)) return;
      push_to_feeds(head, row, stop);
    }
  }
}

}  // namespace merkel
