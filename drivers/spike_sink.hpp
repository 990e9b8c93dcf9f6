#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>

#include "core/expected.hpp"
#include "core/records/loop_event.hpp"
#include "core/records/neuron_sample.hpp"
#include "core/records/probe_sample.hpp"
#include "core/records/run_status.hpp"
#include "core/records/spike_event.hpp"
#include "core/records/stimulation_command.hpp"
#include "core/records/tick_record.hpp"
#include "drivers/raw_frame.hpp"
#include "drivers/run_control.hpp"

namespace merkel {

/// Zero of the times in files: with devices, the start of the run; for a recording, the zero of its
/// own time base.
struct RunOrigin {
  std::chrono::nanoseconds start{0};  ///< in probe time
  std::chrono::nanoseconds utc{0};    ///< the same instant since 1970-01-01; 0: unknown
};

/// Why a sink accepts no more spikes.
struct SinkError {
  std::string sentence;  ///< the problem and the remedy
};

/// A consumer of spikes: a file, a socket, a page. Used by one thread, which may block.
///
/// Every sink receives spikes. A sink that needs more data lists it in subscriptions().
class SpikeSink {
 public:
  /// Data that a sink can receive besides spikes; bits.
  enum Subscription : std::uint32_t {
    kTicks = 1U << 0U,        ///< the input of the loop: each probe at each tick
    kEvents = 1U << 1U,       ///< releases, gaps, resets
    kSamples = 1U << 2U,      ///< calibrated samples as the probes delivered them
    kStatus = 1U << 3U,       ///< the run's counters, five times a second and at the end
    kFrames = 1U << 4U,       ///< the bytes that pass the devices' ports
    kMarks = 1U << 5U,        ///< instants marked by the user
    kNeurons = 1U << 6U,      ///< drive and potential of the watched neurons
    kStimulation = 1U << 7U,  ///< stimulation commands; the run stops them if the sink fails
  };

  SpikeSink() = default;
  SpikeSink(const SpikeSink&) = delete;
  SpikeSink& operator=(const SpikeSink&) = delete;
  virtual ~SpikeSink() = default;

  /// The URI it was opened with. Thread: any.
  [[nodiscard]] virtual const std::string& uri() const noexcept = 0;

  /// Receives the run's origin once, before any data. Errors as for write(). Thread:
  /// consumer.
  [[nodiscard]] virtual Expected<void, SinkError> begin(const RunOrigin& /*origin*/) { return {}; }

  /// Receives spikes in order of time, ties by patch and neuron. After an error the sink is closed
  /// and receives no more. Thread: consumer.
  [[nodiscard]] virtual Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) = 0;

  /// Subscription bits; constant. Data that no sink subscribes to is not produced. Thread: any.
  [[nodiscard]] virtual std::uint32_t subscriptions() const noexcept { return 0; }

  /// Receives subscribed data, each kind in order of time. The spikes of a tick are written before
  /// the tick's records. Errors as for write(). Thread: consumer.
  [[nodiscard]] virtual Expected<void, SinkError> write_ticks(
      std::span<const TickRecord> /*ticks*/) {
    return {};
  }
  [[nodiscard]] virtual Expected<void, SinkError> write_events(
      std::span<const LoopEvent> /*events*/) {
    return {};
  }
  /// \param probe  index of the probe
  [[nodiscard]] virtual Expected<void, SinkError> write_samples(
      std::size_t /*probe*/, std::span<const ProbeSample> /*samples*/) {
    return {};
  }
  /// \param port  index of the port, below Probe::ports()
  [[nodiscard]] virtual Expected<void, SinkError> write_frames(
      std::size_t /*probe*/, std::size_t /*port*/, std::span<const RawFrame> /*frames*/) {
    return {};
  }
  [[nodiscard]] virtual Expected<void, SinkError> write_status(const RunStatus& /*status*/) {
    return {};
  }

  /// Commands in order of time, before the records of their tick. The last update of a run has
  /// every electrode off.
  [[nodiscard]] virtual Expected<void, SinkError> write_commands(
      std::span<const StimulationCommand> /*commands*/) {
    return {};
  }
  /// True if its receiver acts on commands or shows them as they come. On the host's clock, its
  /// commands pass a StimulationGate; all other sinks record what the encoder commanded.
  /// Thread: any.
  [[nodiscard]] virtual bool stimulates() const noexcept { return false; }
  /// False of a sink that has no use for spikes: it gets none. Thread: any.
  [[nodiscard]] virtual bool takes_spikes() const noexcept { return true; }

  [[nodiscard]] virtual Expected<void, SinkError> write_marks(std::span<const Mark> /*marks*/) {
    return {};
  }
  [[nodiscard]] virtual Expected<void, SinkError> write_neurons(
      std::span<const NeuronSample> /*samples*/) {
    return {};
  }

  /// Receives the interface to its run, which outlives the sink's use. Called once, before the run.
  virtual void attach(RunControl& /*control*/) {}

  /// An address for the user to open, such as a page's; empty if none. Thread: any.
  [[nodiscard]] virtual std::string address() const { return {}; }

  /// Writes out buffered data; called five times a second. Thread: consumer.
  [[nodiscard]] virtual Expected<void, SinkError> flush() { return {}; }

  /// Ends the output: flushes, completes the format, gives a file its name. Thread: consumer.
  [[nodiscard]] virtual Expected<void, SinkError> close() = 0;

  /// Makes a call that waits for a peer (a pipe's reader, a subscriber) fail at once, so that the
  /// program can end. Thread: any, while another call blocks.
  virtual void give_up() noexcept {}

  /// The number of written spikes that are known to be delivered. Thread: consumer.
  [[nodiscard]] virtual std::uint64_t delivered() const noexcept = 0;
};

}  // namespace merkel
