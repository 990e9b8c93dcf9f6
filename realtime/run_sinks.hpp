#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/records/run_status.hpp"
#include "drivers/sink.hpp"
#include "realtime/input/frame_tap.hpp"
#include "realtime/output/fanout.hpp"
#include "realtime/output/sink_writer.hpp"
#include "realtime/run_report.hpp"

namespace merkel {

class RunProbes;

/// The sinks of a run, each with its thread and its queues from the loop. Thread: that of
/// Pipeline::run(), unless stated otherwise.
class RunSinks {
 public:
  /// \param neurons   of the model
  /// \param commands  whether the scene has electrodes
  /// \param arrays  whether it has tactile arrays
  RunSinks(Fanout& fanout, RunProbes& probes, std::size_t neurons, bool commands,
           bool arrays) noexcept
      : fanout_(fanout), probes_(probes), neurons_(neurons), commands_(commands), arrays_(arrays) {}
  RunSinks(const RunSinks&) = delete;
  RunSinks& operator=(const RunSinks&) = delete;
  ~RunSinks();

  void add(std::unique_ptr<Sink> sink);
  /// Adds a feed of a probe's samples for each sink that takes samples.
  [[nodiscard]] std::vector<Feed<DeliveredSample>*> add_sample_feeds(std::size_t capacity,
                                                                     std::uint32_t probe,
                                                                     const ProbeColumns& columns);
  /// Listens to the ports of all devices for the sinks that take frames.
  void listen();

  /// Starts the threads. The sinks may make requests from now on.
  /// \param status  the run's counters; any thread
  /// \param watch   for the gates of stimulation commands
  void start(const std::function<RunStatus()>& status, const SharedOrigin& origin,
             const RunWatch& watch, const RealtimeSettings& realtime);
  /// Reports each sink that has failed, once, with its URI and the reason.
  void report_failures(
      const std::function<void(const std::string&, const std::string&)>& on_failure);
  /// Ends all sinks at the same time and reports them. A sink that waits for a peer has until
  /// `patience` is over, or until `hurry` is set.
  void finish(RunReport& report, std::chrono::milliseconds patience,
              const std::atomic<bool>& hurry);

 private:
  class Control;
  struct Entry {
    std::unique_ptr<RunControl> control;  ///< borrowed by the sink
    std::unique_ptr<Sink> sink;
    ConsumerChannel& channel;
    std::vector<std::unique_ptr<FrameTap>> taps = {};
    std::unique_ptr<SinkWriter> writer = nullptr;
    bool failure_reported = false;
  };

  Fanout& fanout_;
  RunProbes& probes_;
  std::size_t neurons_;
  bool commands_;
  bool arrays_;
  std::vector<std::unique_ptr<Entry>> entries_;
  std::atomic<bool> started_{false};  ///< all probes and sinks exist
};

}  // namespace merkel
