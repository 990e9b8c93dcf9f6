#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/clock/clock_map.hpp"
#include "drivers/sink_setup.hpp"
#include "drivers/sinks/run_journal.hpp"
#include "tools/run/recorded_session.hpp"

namespace merkel {

/// How sessions are aligned, and who learns how far a long work has come.
struct MergeSettings {
  std::string mark = {};  ///< by the marks with this label; empty: by the UTC of the hosts
  bool pulses = false;    ///< by the pulses of the sync line that all of them saw
  std::function<void(const std::string&)> progress = {};
};

/// Sessions of several rigs on one clock, that of the first session, as one run. Neurons, patches,
/// probes and electrodes are numbered through all sessions, in their order. Reading merges the
/// files in order of time, in bounded memory: each session is open from its start to its end, with
/// one of its chunks waiting. Events come when they were reported.
class MergedSessions final : public RunJournal {
 public:
  /// How a session's clock was placed on that of the first.
  struct Alignment {
    std::string session;
    std::chrono::nanoseconds offset{0};  ///< added to its start
    double rate = 0.0;                   ///< by which its clock is slower, as a fraction
    /// How far its converted times may be off. Empty: unknown.
    std::optional<std::chrono::nanoseconds> residual;
    std::string how;  ///< for the user
  };

  /// Reads what sessions are and aligns them.
  [[nodiscard]] static Expected<std::shared_ptr<MergedSessions>, SetupError> open(
      const std::vector<std::string>& paths, const MergeSettings& settings);

  /// Spikes, samples, edges, commands, events and marks.
  [[nodiscard]] Expected<void, std::string> read(const Take& take) override;
  /// The sessions.
  [[nodiscard]] std::vector<RunJournal::Part> parts() override;

  [[nodiscard]] const std::vector<Alignment>& alignments() const noexcept { return alignments_; }
  [[nodiscard]] const RunDescription& run() const noexcept { return run_; }
  [[nodiscard]] const RunOrigin& origin() const noexcept { return sessions_[0].session->origin(); }
  [[nodiscard]] std::uint32_t neurons() const noexcept { return neurons_; }
  /// False if the last read() found that a recording broke off.
  [[nodiscard]] bool complete() const noexcept { return complete_; }

 private:
  /// A session, and what is added to its times and numbers.
  struct Merged {
    std::unique_ptr<RecordedSession> session;
    std::string rig;  ///< its name in this merge
    std::uint32_t neurons = 0;
    std::uint32_t probes = 0;
    std::uint16_t patches = 0;
    std::uint16_t electrodes = 0;

    void add(const SessionChunk& chunk, RecordLists<RecordVector>& to) const;
    /// Its numbers of probes, electrodes and afferents count through all sessions.
    template <class Record>
    void renumber(Record& record) const;
  };
  class Reading;

  MergedSessions() = default;
  void add(std::unique_ptr<RecordedSession> session, std::string rig, const ClockMap& clock);

  std::vector<Merged> sessions_;
  std::vector<Alignment> alignments_;  ///< of all sessions but the first
  RunDescription run_;
  std::uint32_t neurons_ = 0;
  std::uint32_t probes_ = 0;
  bool complete_ = true;
  std::function<void(const std::string&)> progress_;
};

}  // namespace merkel
