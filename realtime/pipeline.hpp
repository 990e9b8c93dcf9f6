#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/expected.hpp"
#include "core/records/given_drive.hpp"
#include "core/records/loop_event.hpp"
#include "core/records/run_counters.hpp"
#include "core/records/run_status.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/probe.hpp"
#include "drivers/sink.hpp"
#include "realtime/clocks/periodic_clock.hpp"
#include "realtime/input/probe_input.hpp"
#include "realtime/loop/loop_statistics.hpp"
#include "realtime/loop/tick_timing.hpp"
#include "realtime/output/spike_consumer.hpp"
#include "realtime/queues/plain_data.hpp"
#include "realtime/run_report.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {

class SpinningTeam;
class StimulationEncoder;

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

  /// Adds a device that feeds one probe, the next one.
  void add_probe(std::unique_ptr<Probe> probe, const ProbeInput::Parameters& parameters);
  /// Adds a device that feeds several probes. \param inputs  one for each of its outputs
  void add_device(std::unique_ptr<Probe> device, const std::vector<RunInput>& inputs);
  void add_sink(std::unique_ptr<Sink> sink);
  /// Adds a consumer that polls its own queue from a single thread.
  /// \param capacity  spikes that may wait; further ones are dropped and counted
  SpikeConsumer add_consumer(std::size_t capacity);

  /// Runs to the end of the streams or until request_stop(). Blocks; call once. Fails before the
  /// start if a probe is silent or the probes do not match the model.
  [[nodiscard]] Expected<RunReport, SetupError> run();

  /// Ends the run within a tick. Safe to call from any thread or a signal handler.
  void request_stop() noexcept;
  /// The same, and no sink waits for a peer any more: files are finished, but an unread pipe and
  /// slow subscribers are abandoned. Safe to call from a signal handler.
  void request_stop_now() noexcept;

  /// Stops the stimulation of the run by hand, and starts it again. Safe to use from any thread or
  /// a signal handler.
  [[nodiscard]] StimulationSwitch& stimulation() noexcept;

  /// Gives an electrode whose encoder is `own`, and its group, a drive from the next tick on; it
  /// must be renewed within the watchdog. What waits longer than that, before the loop begins or
  /// while it hangs, is dropped. False if too many wait. Its time is ignored. Thread: any.
  [[nodiscard]] bool give_drive(const GivenDrive& drive);

  [[nodiscard]] const LoopStatistics& statistics() const noexcept;
  /// All counters so far. Thread: any, once the run has started.
  [[nodiscard]] RunCounters counters() const;
  /// The same with the loop's rights; the losses are 0. Thread: any, once the run has started.
  [[nodiscard]] RunStatus status() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace merkel
