#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/records/run_status.hpp"
#include "drivers/sink.hpp"
#include "realtime/input/frame_tap.hpp"
#include "realtime/output/fanout.hpp"
#include "realtime/output/gate_thread.hpp"
#include "realtime/output/sink_writer.hpp"
#include "realtime/run_report.hpp"

namespace merkel {

class RunProbes;

/// The sinks of a run, each with its thread and its queues from the loop. Thread: that of
/// Pipeline::run(), unless stated otherwise.
class RunSinks {
 public:
  struct Run {
    std::size_t neurons = 0;
    bool commands = false;  ///< the scene has electrodes
    bool arrays = false;    ///< it has tactile arrays
    bool fast = false;      ///< on a virtual clock
  };
  /// \param watch  for the gate of stimulation commands
  RunSinks(Fanout& fanout, RunProbes& probes, RunWatch& watch, const Run& run) noexcept
      : fanout_(fanout), probes_(probes), watch_(watch), run_(run) {}
  RunSinks(const RunSinks&) = delete;
  RunSinks& operator=(const RunSinks&) = delete;
  ~RunSinks();

  void add(std::unique_ptr<Sink> sink);
  /// Adds a feed of a probe's samples for each sink that takes samples.
  [[nodiscard]] std::vector<Feed<DeliveredSample>*> add_sample_feeds(std::size_t capacity,
                                                                     std::uint32_t probe,
                                                                     const ProbeColumns& columns);
  /// Listens to the ports and sync lines of all devices, for the sinks that take frames or edges.
  void listen();

  /// Starts the threads. The sinks may make requests from now on.
  /// \param status  the run's counters; any thread
  void start(const std::function<RunStatus()>& status, const SharedOrigin& origin,
             const RealtimeSettings& realtime);
  /// Sends a mark to every sink that takes marks. Thread: any.
  void mark(const Mark& mark);
  /// Reports each sink that has failed, once, with its URI and the reason.
  void report_failures(
      const std::function<void(const std::string&, const std::string&)>& on_failure);
  /// Passes on what the sinks report.
  void take_notices(const std::function<void(const std::string&)>& on_notice);
  /// Ends all sinks at the same time and reports them. A sink that waits for a peer has until
  /// `patience` is over, or until `end_now` is set.
  void finish(RunReport& report, std::chrono::milliseconds patience,
              const std::atomic<bool>& end_now);

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

  /// Whether records of a kind come to a sink that takes them.
  template <class Record>
  [[nodiscard]] bool is_produced(const Sink& sink) const noexcept;

  Fanout& fanout_;
  RunProbes& probes_;
  RunWatch& watch_;
  Run run_;
  std::unique_ptr<GateThread> gate_;  ///< outlives the writers
  std::vector<std::unique_ptr<Entry>> entries_;
  std::mutex mutex_;
  std::vector<std::string> notices_;  ///< guarded by mutex_
  std::atomic<bool> started_{false};  ///< all probes and sinks exist
};

}  // namespace merkel
