#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/records/run_counters.hpp"
#include "core/records/tick_record.hpp"
#include "drivers/probe.hpp"
#include "drivers/sink.hpp"
#include "realtime/clocks/periodic_clock.hpp"
#include "realtime/input/probe_input.hpp"
#include "realtime/loop/press_watch.hpp"
#include "realtime/queues/latency_histogram.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {

/// Timing of the simulation on the host's clock.
struct HostTimeReport {
  LoopWait wait = LoopWait::kHybrid;
  std::chrono::nanoseconds margin{0};  ///< of the hybrid wait, at the end of the run
  RealtimeRights rights;
  ThreadUsage usage;                 ///< of the simulation thread, while it ran
  LatencySummary way;                ///< for devices: from a sample's time to its arrival
  LatencySummary tick_end;           ///< for devices: from a sample's time to the end of its tick
  LatencySummary delay;              ///< of the loop
  LatencySummary sample_to_spike;    ///< for devices: from a sample's arrival to its spikes
  LatencySummary sample_to_command;  ///< the same to the commands for the electrodes
  /// The same for the last five to ten seconds.
  LatencySummary recent_sample_to_spike;
  LatencySummary recent_sample_to_command;
  LatencySummary wake_up;
  LatencySummary queue;
  LatencySummary tick;
  LatencySummary processor;  ///< what a tick and its publication used of a processor
  LatencySummary publish;
};

/// A stop of the stimulation by hand.
struct StimulationStopReport {
  StimulationSwitch::By by = StimulationSwitch::By::kNone;  ///< kNone: there was none
  std::chrono::nanoseconds at{0};                           ///< since the start of the run
};

/// The result of a run: its counters, overall and per probe and sink.
struct RunReport : RunCounters {
  struct ProbeReport {
    std::string uri;
    std::uint64_t samples_in = 0;        ///< delivered by the probe
    std::uint64_t dropped = 0;           ///< of these, dropped because the queue was full
    std::uint64_t unused = 0;            ///< of these, still queued when the run ended
    ProbeInput::Counts counts;           ///< of these, used and late; also ticks held or released
    std::uint64_t releases = 0;          ///< outages in which the probe was released
    std::optional<DeviceCounts> device;  ///< counted by the driver; none for a recording
    bool shares_device = false;          ///< with an earlier probe, which stands for the device
    std::optional<SampleTiming> timing;  ///< as measured; none for a recording
    OutputFaults faults;                 ///< of its output
    std::chrono::nanoseconds stale_after{0};  ///< the silence after which it is released; 0: never
    std::uint32_t channels = 0;               ///< of its samples
    ProbeInput::Decimate decimate = ProbeInput::Decimate::kLast;
    DeepestPress deepest_press;           ///< as it reported it
    PressRange press_range;               ///< of its readings
    ContactDecision::Drift drift;         ///< of its zero
    ContactDecision::Parameters contact;  ///< by which its contact was decided
  };
  struct OfSink {
    std::string uri;
    std::uint64_t spikes_in = 0;         ///< produced by the loop
    std::uint64_t dropped = 0;           ///< of these, dropped because the sink's queue was full
    std::uint64_t delivered = 0;         ///< of these, known to have arrived
    std::uint64_t commands_in = 0;       ///< stimulation commands, if the sink takes them
    std::uint64_t commands_refused = 0;  ///< of these, not passed on by the sink
    std::string error_message;           ///< empty, or the reason why the sink failed

    /// Spikes taken from the queue, but not known to have arrived.
    [[nodiscard]] std::uint64_t lost() const noexcept { return spikes_in - dropped - delivered; }
  };
  std::vector<ProbeReport> probes;
  std::vector<OfSink> sinks;
  std::chrono::nanoseconds start{0};      ///< probe time of the first tick
  std::chrono::nanoseconds simulated{0};  ///< probe time simulated, gaps included
  std::chrono::nanoseconds wall{0};       ///< duration of the run
  std::chrono::nanoseconds delay{0};      ///< of the loop, at the end of the run
  /// Of all ticks that were on time.
  std::chrono::nanoseconds smallest_delay{0};
  std::chrono::nanoseconds median_delay{0};
  std::chrono::nanoseconds largest_delay{0};
  bool delay_measured = false;  ///< it followed the devices; otherwise the scene sets it
  std::chrono::nanoseconds delay_ceiling{0};  ///< of a measured delay that did not suffice; else 0
  std::vector<std::uint64_t> spikes_of_neuron;
  std::vector<std::uint64_t>
      contact_spikes_of_neuron;                       ///< while a probe touched the neuron's patch
  std::vector<std::uint64_t> contact_ticks_of_patch;  ///< ticks in which a probe touched the patch

  std::optional<HostTimeReport> host_time;  ///< only for runs on the host's clock
  StimulationStopReport stimulation_stop;   ///< the last one
  StimulationSwitch::By stimulation_stopped = StimulationSwitch::By::kNone;  ///< at the end
  std::string error_message;  ///< empty, or the reason why a probe's stream failed
  bool bad_input = false;     ///< the stream failed because of an invalid recording, not a device
  bool interrupted = false;   ///< stopped before the end of the streams

  [[nodiscard]] bool complete() const;
  /// Why a probe or, after them, the first sink failed; empty if none did.
  [[nodiscard]] std::string failure() const;
};

/// Why a run did not start, or why one of its probes or sinks failed; empty if all went well.
[[nodiscard]] std::string failure_of(const Expected<RunReport, SetupError>& report);

/// The progress of a run. Thread: any.
struct RunProgress {
  /// The current reading of a probe.
  struct ProbeProgress {
    double depth_mm = 0.0;
    double force_mN = 0.0;
    std::uint32_t channels = 0;
    TickRecord::State state = TickRecord::State::kFollowing;
    std::string name = {};              ///< for display
    bool live = false;                  ///< a device
    std::chrono::nanoseconds touch{0};  ///< the length of the touch so far; 0: none
  };
  std::vector<ProbeProgress> probes;
  std::chrono::nanoseconds wall{0};  ///< since the simulation began
  std::chrono::nanoseconds simulated{0};
  std::chrono::nanoseconds known{0};  ///< to simulate: up to the newest sample or the duration
  RunCounters counters;
  LatencyHistogram::Snapshot wake_up;
  LatencyHistogram::Snapshot tick;
};

}  // namespace merkel
