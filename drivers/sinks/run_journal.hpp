#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <future>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/records/record_batch.hpp"
#include "drivers/clock/clock_map.hpp"

namespace merkel {

/// The records of a run that is over, which can be read more than once: what the formats are made
/// from that need the whole run. One thread at a time reads. Real-time: no.
class RunJournal {
 public:
  /// Receives records in the order of a session: each kind in order of time. False ends the
  /// reading.
  using Take = std::function<bool(const RecordBatch&)>;

  RunJournal() = default;
  RunJournal(const RunJournal&) = delete;
  RunJournal& operator=(const RunJournal&) = delete;
  virtual ~RunJournal() = default;

  /// Reads all records from the beginning, in bounded memory. Returns the reason if it cannot.
  [[nodiscard]] virtual Expected<void, std::string> read(const Take& take) = 0;

  /// The readings of the host's clocks during the run, from its clock to UTC; known after read().
  [[nodiscard]] virtual std::vector<ClockReading> clock_readings() const { return {}; }

  /// One of several runs in a journal. Its records have its own numbers of neurons, probes and
  /// electrodes.
  struct Part {
    RunJournal& journal;
    std::chrono::nanoseconds tick{0};
    std::size_t neurons = 0;
    std::size_t probes = 0;
    std::size_t electrodes = 0;
  };
  /// The runs whose neurons, probes and electrodes are numbered through this journal, in order;
  /// empty: it is one run.
  [[nodiscard]] virtual std::vector<Part> parts() { return {}; }
};

/// A session that a sink of the same run writes. Its readers wait until it is complete.
class SessionJournal final : public RunJournal {
 public:
  SessionJournal() = default;
  /// A complete session.
  explicit SessionJournal(std::string path) { complete(std::move(path)); }

  /// The session has its name; readers go on. Thread: the writer's; first of the two calls counts.
  void complete(std::string path) { settle(std::move(path)); }
  /// The session will not be completed. \param reason  for the user
  void fail(std::string reason) { settle(Unexpected<std::string>(std::move(reason))); }

  [[nodiscard]] Expected<void, std::string> read(const Take& take) override;

 private:
  void settle(Expected<std::string, std::string> outcome) {
    if (!std::exchange(settled_, true)) outcome_.set_value(std::move(outcome));
  }

  bool settled_ = false;
  std::promise<Expected<std::string, std::string>> outcome_;  ///< the path, or why there is none
  std::shared_future<Expected<std::string, std::string>> path_ = outcome_.get_future().share();
};

}  // namespace merkel
