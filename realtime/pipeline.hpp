#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/records/loop_event.hpp"
#include "core/records/run_counters.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/probe.hpp"
#include "drivers/spike_sink.hpp"
#include "realtime/clocks/periodic_clock.hpp"
#include "realtime/input/probe_input.hpp"
#include "realtime/loop/latency_histogram.hpp"
#include "realtime/loop/loop_statistics.hpp"
#include "realtime/loop/press_watch.hpp"
#include "realtime/loop/tick_timing.hpp"
#include "realtime/output/sink_writer.hpp"
#include "realtime/output/spike_fanout.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {

struct SampleTap;
class SpinningTeam;
class StimulationEncoder;

/// Timing of the simulation on the host's clock.
struct HostTimeReport {
  LoopWait wait = LoopWait::kHybrid;
  std::chrono::nanoseconds margin{0};  ///< of the hybrid wait, at the end of the run
  RealtimeRights rights;
  ThreadUsage usage;               ///< of the simulation thread, while it ran
  LatencySummary sample_to_spike;  ///< for devices: from a sample's arrival to its spikes
  LatencySummary wake_up;
  LatencySummary queue;
  LatencySummary tick;
  LatencySummary publish;
};

/// The result of a run: its counters, overall and per probe and sink.
struct RunReport : RunCounters {
  struct OfProbe {
    std::string uri;
    std::uint64_t samples_in = 0;        ///< delivered by the probe
    std::uint64_t dropped = 0;           ///< of these, dropped because the queue was full
    std::uint64_t unused = 0;            ///< of these, still queued when the run ended
    ProbeInput::Counts counts;           ///< of these, used and late; also ticks held or released
    std::uint64_t releases = 0;          ///< outages in which the probe was released
    std::optional<DeviceCounts> device;  ///< counted by the driver; none for a recording
    std::optional<SampleTiming> timing;  ///< as measured; none for a recording
    std::chrono::nanoseconds stale_after{0};  ///< the silence after which it is released; 0: never
    std::uint32_t channels = 0;               ///< of its samples
    DeepestPress deepest_press;               ///< as it reported it
  };
  struct OfSink {
    std::string uri;
    std::uint64_t spikes_in = 0;    ///< produced by the loop
    std::uint64_t dropped = 0;      ///< of these, dropped because the sink's queue was full
    std::uint64_t delivered = 0;    ///< of these, known to have arrived
    std::uint64_t commands_in = 0;  ///< stimulation commands, if the sink takes them
    std::string error_message;      ///< empty, or the reason why the sink failed

    /// Spikes taken from the queue, but not known to have arrived.
    [[nodiscard]] std::uint64_t lost() const noexcept { return spikes_in - dropped - delivered; }
  };
  std::vector<OfProbe> probes;
  std::vector<OfSink> sinks;
  std::chrono::nanoseconds start{0};      ///< probe time of the first tick
  std::chrono::nanoseconds simulated{0};  ///< probe time simulated, gaps included
  std::chrono::nanoseconds wall{0};       ///< duration of the run
  std::chrono::nanoseconds delay{0};      ///< of the loop, at the end of the run
  std::vector<std::uint64_t> spikes_of_neuron;
  std::vector<std::uint64_t>
      contact_spikes_of_neuron;                       ///< while a probe touched the neuron's patch
  std::vector<std::uint64_t> contact_ticks_of_patch;  ///< ticks in which a probe touched the patch

  std::optional<HostTimeReport> host_time;  ///< only for runs on the host's clock
  std::string error_message;                ///< empty, or the reason why a probe's stream failed
  bool bad_input = false;    ///< it did because of the recording given, not of a device
  bool interrupted = false;  ///< stopped before the end of the streams

  [[nodiscard]] bool complete() const;
};

/// The progress of a run. Thread: any.
struct RunProgress {
  /// The current reading of a probe.
  struct OfProbe {
    double depth_mm = 0.0;
    double force_mN = 0.0;
    std::uint32_t channels = 0;
    TickRecord::State state = TickRecord::State::kFollowing;
  };
  std::vector<OfProbe> probes;
  std::chrono::nanoseconds wall{0};  ///< since the simulation began
  RunCounters counters;
  LatencyHistogram::Snapshot wake_up;
  LatencyHistogram::Snapshot tick;
};

/// The whole data path: probes → queues → loop → model → fan-out → sinks, with one thread for each
/// probe, each sink and the simulation.
///
/// Add the probes in the order of the model's indenters, add sinks and consumers, then call run()
/// once.
class Pipeline {
 public:
  struct Parameters {
    bool fast = false;  ///< virtual clock: as fast as possible; recordings only
    /// Default: for devices the measured delay of their samples (Probe::timing), for recordings 0.
    std::optional<std::chrono::nanoseconds> delay;
    std::optional<std::chrono::nanoseconds> duration;  ///< of probe time
    /// How far behind the loop may fall before it skips ticks. Default: 20 ticks with devices;
    /// unlimited with recordings, where every tick counts and no external process waits for the
    /// loop.
    std::optional<std::int64_t> max_catch_up_ticks;
    LoopWait wait = LoopWait::kHybrid;
    RealtimeSettings realtime;
    StimulationEncoder* encoder = nullptr;  ///< of a scene with electrodes; borrowed
    SpinningTeam* team = nullptr;  ///< shares the model's work and rests between ticks; borrowed
    BoundedQueue<TickTiming>* timings = nullptr;     ///< receives one item per tick with spikes
    std::function<void(const LoopEvent&)> on_event;  ///< called on the thread of run()
    /// Called on the thread of run() as soon as a sink fails, with its URI and the reason.
    std::function<void(const std::string&, const std::string&)> on_sink_failure;
    /// Called on the thread of run(), four times a second.
    std::function<void(const RunProgress&)> on_progress;
    /// Called on the thread of run() with each right that the host refused.
    std::function<void(const std::string&)> on_missing_right;
    std::function<void(const std::string&)>
        on_notice;  ///< the same, with each notice of a device's driver
    /// How long a sink may take to write its remaining items after the run; then it is abandoned.
    std::chrono::milliseconds ending_patience{5000};
  };

  /// \param model  borrowed; its spikes and contacts can be read after run()
  Pipeline(TactileModel& model, Parameters parameters);
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;
  ~Pipeline();

  void add_probe(std::unique_ptr<Probe> probe, const ProbeInput::Parameters& parameters);
  void add_sink(std::unique_ptr<SpikeSink> sink);
  /// Adds a consumer that polls its own queue from a single thread.
  SpikeChannel& add_consumer(std::size_t capacity);

  /// Runs to the end of the streams or until request_stop(). Blocks; call once. Fails before the
  /// start if a probe is silent or the probes do not match the model.
  [[nodiscard]] Expected<RunReport, SetupError> run();

  /// Ends the run within a tick. Safe to call from any thread or a signal handler.
  void request_stop() noexcept { stop_.store(true, std::memory_order_relaxed); }
  /// The same, and no sink waits for a peer any more: files are finished, but an unread pipe and
  /// slow subscribers are abandoned. Safe to call from a signal handler.
  void request_stop_now() noexcept {
    hurry_.store(true, std::memory_order_relaxed);
    request_stop();
  }

  [[nodiscard]] const LoopStatistics& statistics() const noexcept { return statistics_; }
  /// All counters so far. Thread: any, once the run has started.
  [[nodiscard]] RunCounters counters() const;
  /// The same with the loop's rights; the losses are 0. Thread: any, once the run has started.
  [[nodiscard]] RunStatus status() const;

 private:
  struct ProbeLine;
  struct SinkLine;
  class SinkControl;
  Expected<void, SetupError> start_probes();
  Expected<void, SetupError> wait_for_first_samples();
  void wait_for_timing();
  [[nodiscard]] std::vector<RunProgress::OfProbe> readings() const;
  [[nodiscard]] std::chrono::nanoseconds measured_delay() const;
  template <class C>
  void run_loop(C& clock, RunReport& report);
  void drain_events(RunReport& report);
  std::vector<SampleTap*> add_taps(const ProbeLine& probe);
  void add_frame_taps();
  void report_sink_failures();
  void finish(RunReport& report);
  void finish_sinks(RunReport& report);

  TactileModel& model_;
  Parameters parameters_;
  std::vector<std::unique_ptr<ProbeLine>> probes_;
  std::vector<std::unique_ptr<SinkLine>> sinks_;
  std::vector<ProbeInput> inputs_;
  SpikeFanout fanout_;
  RunStatus::Rights rights_;
  std::atomic<bool> rights_known_{false};  ///< set after rights_
  LoopStatistics statistics_;
  BoundedQueue<LoopEvent> events_;
  std::atomic<std::int64_t> delay_ns_{0};
  std::atomic<bool> wired_{false};  ///< all probes and sinks exist; set when the run begins
  std::atomic<bool> stop_{false};
  std::atomic<bool> hurry_{false};
  SharedOrigin origin_;
};

}  // namespace merkel
