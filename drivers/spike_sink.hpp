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

/// What the times of files are counted from: with devices the start of the run; of a recording, the
/// zero of its own times.
struct RunOrigin {
  std::chrono::nanoseconds start{0};  ///< in probe time
  std::chrono::nanoseconds utc{0};    ///< the same instant since 1970-01-01; 0: not known
};

/// Why a sink takes no more spikes.
struct SinkError {
  std::string sentence;  ///< what went wrong and what to do
};

/// A consumer of spikes: a file, a socket, a page. Used by one thread, which may block.
///
/// Spikes are what every sink receives. A sink that needs more data lists it in subscriptions().
class SpikeSink {
 public:
  /// What a sink may ask for besides spikes; bits.
  enum Subscription : std::uint32_t {
    kTicks = 1U << 0U,        ///< what the loop used of every probe at every tick
    kEvents = 1U << 1U,       ///< releases, gaps, resets
    kSamples = 1U << 2U,      ///< calibrated samples as the probes delivered them
    kStatus = 1U << 3U,       ///< the run's counters, some times a second and at the end
    kFrames = 1U << 4U,       ///< the bytes that go over the devices' ports
    kMarks = 1U << 5U,        ///< moments that a person marked
    kNeurons = 1U << 6U,      ///< drive and potential of the neurons it watches
    kStimulation = 1U << 7U,  ///< stimulation commands; the run stops them if the sink fails
  };

  SpikeSink() = default;
  SpikeSink(const SpikeSink&) = delete;
  SpikeSink& operator=(const SpikeSink&) = delete;
  virtual ~SpikeSink() = default;

  /// The URI it was opened with. Thread: any.
  [[nodiscard]] virtual const std::string& uri() const noexcept = 0;

  /// Receives the run's origin once, before anything is written. Errors as of write(). Thread:
  /// consumer.
  [[nodiscard]] virtual Expected<void, SinkError> begin(const RunOrigin& /*origin*/) { return {}; }

  /// Takes spikes in order of time, ties by patch and neuron. After an error the sink is closed
  /// and takes no more. Thread: consumer.
  [[nodiscard]] virtual Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) = 0;

  /// Subscription bits; constant. Data that no sink subscribes to is not produced. Thread: any.
  [[nodiscard]] virtual std::uint32_t subscriptions() const noexcept { return 0; }

  /// Takes what it has asked for, each kind in order of time. When a tick's records come, every
  /// spike of that tick has been written before. Errors as of write(). Thread: consumer.
  [[nodiscard]] virtual Expected<void, SinkError> write_ticks(
      std::span<const TickRecord> /*ticks*/) {
    return {};
  }
  [[nodiscard]] virtual Expected<void, SinkError> write_events(
      std::span<const LoopEvent> /*events*/) {
    return {};
  }
  /// \param probe  whose samples they are, from 0
  [[nodiscard]] virtual Expected<void, SinkError> write_samples(
      std::size_t /*probe*/, std::span<const ProbeSample> /*samples*/) {
    return {};
  }
  /// \param port  of that probe, from 0: its place in Probe::ports()
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
  /// False of a sink that has no use for spikes: it gets none. Thread: any.
  [[nodiscard]] virtual bool takes_spikes() const noexcept { return true; }

  [[nodiscard]] virtual Expected<void, SinkError> write_marks(std::span<const Mark> /*marks*/) {
    return {};
  }
  [[nodiscard]] virtual Expected<void, SinkError> write_neurons(
      std::span<const NeuronSample> /*samples*/) {
    return {};
  }

  /// What the sink may ask of its run; outlives the sink's use. Called once, before the run.
  virtual void attach(RunControl& /*control*/) {}

  /// Where a person can open it, such as a page's address; empty if nowhere. Thread: any.
  [[nodiscard]] virtual std::string address() const { return {}; }

  /// Hands on whatever is still buffered; called five times a second. Thread: consumer.
  [[nodiscard]] virtual Expected<void, SinkError> flush() { return {}; }

  /// Ends well: flushes, completes the format, gives a file its final name. Thread: consumer.
  [[nodiscard]] virtual Expected<void, SinkError> close() = 0;

  /// Makes every call that waits for somebody else (a pipe's reader, a subscriber) fail at once, so
  /// that the program can end. Thread: any, while another call blocks.
  virtual void give_up() noexcept {}

  /// How many of the spikes written so far are known to have arrived. Thread: consumer.
  [[nodiscard]] virtual std::uint64_t delivered() const noexcept = 0;
};

}  // namespace merkel
