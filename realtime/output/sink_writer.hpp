#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/encoding/stimulation_outlet.hpp"
#include "drivers/sink.hpp"
#include "realtime/output/fanout.hpp"
#include "realtime/output/gate_thread.hpp"
#include "realtime/threads/serving_priority.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {

/// A run's origin, set by the simulation thread once it is known.
class SharedOrigin {
 public:
  /// Thread: simulation; once.
  void set(const RunOrigin& origin) noexcept {
    origin_ = origin;
    known_.store(true, std::memory_order_release);
  }
  /// Null until known. Thread: any.
  [[nodiscard]] const RunOrigin* get() const noexcept {
    return known_.load(std::memory_order_acquire) ? &origin_ : nullptr;
  }

 private:
  RunOrigin origin_;
  std::atomic<bool> known_{false};
};

/// The thread of one sink: takes the records from its feeds and writes them. When the sink fails,
/// it receives nothing more, and every later spike is counted as lost. The other sinks continue.
class SinkWriter {
 public:
  struct Outcome {
    std::uint64_t taken = 0;      ///< spikes taken from the queue
    std::uint64_t delivered = 0;  ///< spikes known to have arrived
    std::string error_message;    ///< empty, or the reason why the sink failed
  };

  /// The sources of a sink; all outlive the writer.
  struct Sources {
    ConsumerChannel& channel;
    std::function<RunStatus()> status;     ///< the run's counters; any thread
    const SharedOrigin* origin = nullptr;  ///< awaited before anything is written; null: origin 0
    const EncodingParameters* encoding = nullptr;   ///< of the electrodes; null: no gate
    GateThread* gate = nullptr;                     ///< takes what the sink does not pass on
    std::uint32_t number = 0;                       ///< of the sink in the run, from 1
    std::optional<RealtimeSettings> realtime = {};  ///< of the simulation, for a receiver's thread
  };

  SinkWriter(Sink& sink, Sources sources);
  SinkWriter(const SinkWriter&) = delete;
  SinkWriter& operator=(const SinkWriter&) = delete;
  /// Ends without closing the sink, unless end() was called; does not wait for the queues to end,
  /// because a run that could not start never ends them.
  ~SinkWriter();

  /// Ends the thread: once all queues have ended and the last item is written, it closes the sink.
  /// If `complete` is false because the run failed, it leaves the sink unfinished. Returns at once.
  void end(bool complete) noexcept;
  /// Whether the thread is done. Thread: any.
  [[nodiscard]] bool done() const noexcept { return done_.load(std::memory_order_acquire); }
  /// Makes the sink fail instead of waiting for a peer. Thread: any.
  void give_up() noexcept { sink_.give_up(); }
  /// Waits until the thread is done.
  [[nodiscard]] Outcome finish();

  /// The reason why the sink failed; empty until it fails. Thread: any, for one caller.
  [[nodiscard]] std::string error_message() const {
    return failed_.load(std::memory_order_acquire) ? outcome_.error_message : std::string();
  }

 private:
  enum class Ending : std::uint8_t { kNotYet, kClose, kAbandon };
  void write_all(const std::stop_token& stop);
  void write_until_ended(const std::stop_token& stop);
  void write(const RecordBatch& batch);
  std::size_t write_waiting();
  [[nodiscard]] std::span<const SentCommand> leaving();
  void refuse(std::span<const SentCommand> commands);
  void wait(std::uint64_t& seen);
  [[nodiscard]] bool all_ended() const;
  void write_status();
  void keep(const Expected<void, SinkError>& result);
  void fail(std::string sentence) noexcept;
  template <class Work>
  void attempt(const Work& work);
  [[nodiscard]] bool healthy() const noexcept { return !failed_.load(std::memory_order_relaxed); }

  Sink& sink_;
  Sources sources_;
  RecordLists<RecordVector> waiting_;        ///< taken from the queues
  std::optional<StimulationOutlet> outlet_;  ///< of a receiver behind a gate
  std::optional<ServingPriority> priority_;
  Outcome outcome_;
  std::string out_of_memory_;  ///< made while there is memory
  bool started_ = false;
  std::atomic<bool> failed_{false};
  std::atomic<bool> done_{false};
  std::atomic<Ending> ending_{Ending::kNotYet};
  std::jthread thread_;
};

}  // namespace merkel
