#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "core/records/record_batch.hpp"
#include "drivers/probe.hpp"
#include "realtime/input/contact_decision.hpp"
#include "realtime/input/probe_queue.hpp"
#include "realtime/queues/feed.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {

/// The thread of one device: reads its readings and puts them into the ring to the loop, and the
/// samples of its probes into the sinks' feeds. Decides for each sample whether it touches. A
/// recording waits while the ring is full. Readings of a device are dropped and counted when it is
/// full.
class ProbeReader {
 public:
  /// The receivers of one output.
  struct Receivers {
    ProbeQueue* channel = nullptr;
    ContactDecision* contact = nullptr;         ///< null: undecided
    std::uint32_t probe = 0;                    ///< its number, from 0
    std::vector<Feed<DeliveredSample>*> feeds;  ///< of sinks that take samples
  };
  struct Parameters {
    std::chrono::nanoseconds shift{0};  ///< added to every sample's times
    /// Of the simulation thread: a device's thread runs just below it. None: normal priority.
    std::optional<RealtimeSettings> realtime = {};
    /// Waits while a feed is full instead of dropping samples. Only on a virtual clock, because a
    /// sink must not delay real time.
    bool wait_for_sinks = false;
  };

  /// Of sinks that take the edges of a device's sync lines, and the zeros of its arrays.
  struct DeviceFeeds {
    std::vector<Feed<SyncEdge>*> edges;
    std::vector<Feed<TaxelZeros>*> zeros;
  };

  /// Starts reading. \param receivers  one for each output of the probe
  ProbeReader(Probe& probe, std::vector<Receivers> receivers, DeviceFeeds feeds,
              Parameters parameters);
  ProbeReader(const ProbeReader&) = delete;
  ProbeReader& operator=(const ProbeReader&) = delete;
  /// Stops and joins.
  ~ProbeReader() = default;

  /// Stops reading and joins the thread.
  void stop();

  /// The error that ended the stream early; empty if none. Read it after the channels have ended.
  [[nodiscard]] const std::string& error_message() const noexcept { return error_message_; }
  /// True if the error is in the recording that was passed, not in a device.
  [[nodiscard]] bool bad_input() const noexcept { return bad_input_; }

 private:
  void read_all(const std::stop_token& stop);
  bool deliver(const ReadingHead& head, std::span<const double> row, const std::stop_token& stop);
  void push_to_feeds(const ReadingHead& head, std::span<const double> row,
                     const std::stop_token& stop);
  void push_beside(Readings& readings, const std::stop_token& stop);
  template <class... Record>
  void push(auto& feed, const std::stop_token& stop, const Record&... record);

  Probe& probe_;
  std::vector<Receivers> receivers_;
  DeviceFeeds feeds_;
  Parameters parameters_;
  std::string error_message_;
  bool bad_input_ = false;
  std::jthread thread_;
};

}  // namespace merkel
