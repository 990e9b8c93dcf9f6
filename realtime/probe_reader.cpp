#include "realtime/probe_reader.hpp"

#include <vector>

#include "realtime/thread_setup.hpp"

namespace merkel {

ProbeReader::ProbeReader(Probe& probe, ProbeChannel& channel, std::chrono::nanoseconds shift)
    : probe_(probe), channel_(channel), shift_(shift), thread_([this](const std::stop_token& stop) {
        read_all(stop);
        channel_.ended.store(true, std::memory_order_release);
      }) {}

void ProbeReader::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

bool ProbeReader::deliver(const ProbeSample& sample, const std::stop_token& stop) {
  while (!channel_.samples.try_push(sample)) {
    if (!probe_.info().replayed) {
      channel_.dropped.add();
      return true;
    }
    if (stop.stop_requested()) return false;
    std::this_thread::sleep_for(std::chrono::microseconds{100});
  }
  channel_.delivered.add();
  return true;
}

void ProbeReader::read_all(const std::stop_token& stop) {
  set_up_helper_thread("merkel-probe");
  std::vector<ProbeSample> samples(1024);
  while (!stop.stop_requested()) {
    const auto count = probe_.read(samples, std::chrono::milliseconds{50});
    if (!count) {
      if (count.error() != ProbeError::kEndOfStream) trouble_ = probe_.trouble();
      return;
    }
    for (std::size_t i = 0; i < *count; ++i) {
      samples[i].time += shift_;
      samples[i].arrival += shift_;
      if (!deliver(samples[i], stop)) return;
    }
  }
}

}  // namespace merkel
