#pragma once

#include <chrono>
#include <string>
#include <thread>

#include "drivers/probe.hpp"
#include "realtime/probe_channel.hpp"

namespace merkel {

/// The thread of one probe: reads its samples and puts them into the loop's queue. A recording
/// waits while the queue is full; a device's samples that find it full are dropped and counted.
class ProbeReader {
 public:
  /// Starts reading. \param shift  added to every sample's times
  ProbeReader(Probe& probe, ProbeChannel& channel, std::chrono::nanoseconds shift);
  ProbeReader(const ProbeReader&) = delete;
  ProbeReader& operator=(const ProbeReader&) = delete;
  /// Stops and joins.
  ~ProbeReader() = default;

  /// Stops reading and joins the thread.
  void stop();

  /// What ended the stream before its end, if anything did; read after the channel has ended.
  [[nodiscard]] const std::string& trouble() const noexcept { return trouble_; }

 private:
  void read_all(const std::stop_token& stop);
  bool deliver(const ProbeSample& sample, const std::stop_token& stop);

  Probe& probe_;
  ProbeChannel& channel_;
  std::chrono::nanoseconds shift_;
  std::string trouble_;
  std::jthread thread_;
};

}  // namespace merkel
