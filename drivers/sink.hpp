#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <sys/types.h>

#include "core/expected.hpp"
#include "core/records/record_batch.hpp"
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

/// A consumer of a run's records: a file, a socket, a page. Used by one thread, which may block.
class Sink {
 public:
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;
  virtual ~Sink() = default;

  /// The URI it was opened with. Thread: any.
  [[nodiscard]] virtual const std::string& uri() const noexcept { return uri_; }

  /// Receives the run's origin once, before any data. Errors as for write(). Thread:
  /// consumer.
  [[nodiscard]] virtual Expected<void, SinkError> begin(const RunOrigin& /*origin*/) { return {}; }

  /// Receives records, and takes those that it subscribes to. The spikes of a tick come before its
  /// commands, in the same batch or an earlier one, and both before its records. After an error the
  /// sink is closed and receives no more. Thread: consumer.
  [[nodiscard]] virtual Expected<void, SinkError> write(const RecordBatch& batch) = 0;

  /// The kinds of record that it takes (kKinds); constant. Records that no sink takes are not
  /// produced. A run stops its stimulation if a sink that takes commands fails. Thread: any.
  [[nodiscard]] virtual std::uint32_t subscriptions() const noexcept { return kKinds<SpikeEvent>; }
  template <class Record>
  [[nodiscard]] bool takes() const noexcept {
    return (subscriptions() & kKind<Record>) != 0U;
  }
  /// Whether its receiver acts on commands or shows them as they come: it takes those that have
  /// passed the gate, and not those of the encoder, as a sink does that records. Thread: any.
  [[nodiscard]] bool receives_commands() const noexcept {
    return takes<SentCommand>() && !takes<StimulationCommand>();
  }
  /// True as long as its receiver is away, and once more after that: commands are lost, and the
  /// receiver then gets an off before any other command. Thread: consumer.
  [[nodiscard]] virtual bool interrupted() { return false; }

  /// Further threads that carry its output to the receivers, by their numbers in the kernel. They
  /// live as long as the sink. Thread: consumer.
  [[nodiscard]] virtual std::vector<pid_t> transport_threads() const { return {}; }

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
  [[nodiscard]] virtual std::uint64_t delivered() const noexcept { return delivered_; }

 protected:
  explicit Sink(std::string uri = {}) : uri_(std::move(uri)) {}

  std::string uri_;
  std::uint64_t delivered_ = 0;
};

}  // namespace merkel
