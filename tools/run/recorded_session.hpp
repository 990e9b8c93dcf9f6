#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/expected.hpp"
#include "drivers/clock/clock_map.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sink_setup.hpp"
#include "drivers/sinks/run_journal.hpp"
#include "tools/scene/scene_file.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {

/// A recorded session as the run that it records, which can be read more than once: neurons are
/// numbered as by its scene, and a record of a neuron or an electrode that the scene does not have
/// is an error.
class RecordedSession final : public RunJournal {
 public:
  /// A session without a scene (samples recorded without a simulation) has no neurons.
  [[nodiscard]] static Expected<std::unique_ptr<RecordedSession>, SetupError> open(
      const std::string& path);

  /// The facts of the file, read again from its beginning.
  [[nodiscard]] Expected<SessionReader, SetupError> reader() const {
    return SessionReader::open(path_);
  }
  /// Places it on another clock: from now on, all times are on that one.
  void set_clock(const ClockMap& clock);
  /// Reads the next chunk of a reader of this session, numbered and checked.
  [[nodiscard]] Expected<bool, SetupError> next(SessionReader& reader, SessionChunk& chunk) const;
  [[nodiscard]] Expected<void, std::string> read(const Take& take) override;
  [[nodiscard]] std::vector<ClockReading> clock_readings() const override {
    return clock_readings_;
  }

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] const std::optional<Scene>& scene() const noexcept { return scene_; }
  [[nodiscard]] const RunDescription& run() const noexcept { return run_; }
  [[nodiscard]] const RunOrigin& origin() const noexcept { return origin_; }
  [[nodiscard]] std::uint32_t neurons() const noexcept { return neurons_; }
  /// False if the last read() found that the recording broke off.
  [[nodiscard]] bool complete() const noexcept { return complete_; }

 private:
  RecordedSession() = default;

  std::string path_;
  std::optional<Scene> scene_;
  std::optional<SessionNumbering> numbering_;
  RunDescription run_;
  RunOrigin origin_;
  ClockMap clock_;                            ///< to the clock of set_clock()
  std::vector<ClockReading> clock_readings_;  ///< those of the last read()
  std::uint32_t neurons_ = 0;
  bool complete_ = true;
};

/// Writes a run to sinks and closes them. Fails with kBadInput if the run cannot be read, and with
/// kUnavailable if a sink fails. \param spikes  counts those of the run
[[nodiscard]] Expected<void, SetupError> write_run(RunJournal& run, const RunOrigin& origin,
                                                   std::span<const std::unique_ptr<Sink>> sinks,
                                                   std::uint64_t& spikes);

}  // namespace merkel
