#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "core/records/record_batch.hpp"
#include "drivers/probe.hpp"
#include "realtime/input/probe_channel.hpp"
#include "realtime/queues/feed.hpp"

namespace merkel {

/// The thread of one probe: reads its samples and puts them into the loop's queue. A recording
/// waits while the queue is full. Samples of a device are dropped and counted when the queue is
/// full.
class ProbeReader {
 public:
  struct Parameters {
    std::uint32_t number = 0;                   ///< of the probe
    std::chrono::nanoseconds shift{0};          ///< added to every sample's times
    std::vector<Feed<DeliveredSample>*> feeds;  ///< of sinks that take samples
    /// Waits while a feed is full instead of dropping samples. Only on a virtual clock, because a
    /// sink must not delay real time.
    bool wait_for_sinks = false;
  };

  /// Starts reading.
  ProbeReader(Probe& probe, ProbeChannel& channel, Parameters parameters);
  ProbeReader(const ProbeReader&) = delete;
  ProbeReader& operator=(const ProbeReader&) = delete;
  /// Stops and joins.
  ~ProbeReader() = default;

  /// Stops reading and joins the thread.
  void stop();

  /// The error that ended the stream early; empty if none. Read it after the channel has ended.
  [[nodiscard]] const std::string& error_message() const noexcept { return error_message_; }
  /// True if the error is in the recording that was passed, not in a device.
  [[nodiscard]] bool bad_input() const noexcept { return bad_input_; }

 private:
  void read_all(const std::stop_token& stop);
  bool deliver(const ProbeSample& sample, const std::stop_token& stop);
  void push_to_feed(Feed<DeliveredSample>& feed, const DeliveredSample& item,
                    const std::stop_token& stop);

  Probe& probe_;
  ProbeChannel& channel_;
  Parameters parameters_;
  std::string error_message_;
  bool bad_input_ = false;
  std::jthread thread_;
};

}  // namespace merkel
