#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/encoding/stimulation_gate.hpp"
#include "core/encoding/stimulation_outlet.hpp"
#include "core/expected.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sink.hpp"
#include "drivers/sinks/session_position.hpp"
#include "tools/scene/scene_file.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {

/// Plays a recorded session to sinks at the speed at which it was recorded. What it plays is the
/// recording; nothing is simulated. Reads the file chunk by chunk; going elsewhere reads it again
/// from its beginning.
class SessionPlayback {
 public:
  struct Extent {
    std::chrono::nanoseconds start{0};  ///< start of the first tick
    std::chrono::nanoseconds end{0};    ///< end of the last tick
    std::uint64_t ticks = 0;
  };

  /// Reads a whole session to find its length. Fails if the session holds no ticks.
  [[nodiscard]] static Expected<Extent, SetupError> measure(const std::string& path,
                                                            std::chrono::nanoseconds tick);

  /// \param numbering, sinks  borrowed
  /// \param scene  of the session: its limits of stimulation hold in wall time, as in a run
  /// \param position  followed and kept up to date
  SessionPlayback(std::string path, const Extent& extent, const SessionNumbering& numbering,
                  const Scene& scene, SessionPosition& position,
                  std::span<const std::unique_ptr<Sink>> sinks);

  /// Plays from a position to the end, or until `stop`. If `wait_at_end`, then waits there for a
  /// seek or `stop`. Fails if the file cannot be read or a sink fails.
  [[nodiscard]] Expected<void, SetupError> play(std::chrono::nanoseconds from, bool wait_at_end,
                                                const std::atomic<bool>& stop);

 private:
  template <class Record>
  using Waiting = std::deque<Record>;

  Expected<void, SetupError> go_to(std::chrono::nanoseconds place);
  Expected<void, SetupError> read_until(std::chrono::nanoseconds time);
  void keep_from(std::chrono::nanoseconds time);
  void restore_taxels();
  void send_until(std::chrono::nanoseconds time);
  void send_commands(std::span<const StimulationCommand> commands, std::chrono::nanoseconds place);
  void switch_off(StimulationCommand::Stop stop);
  void keep(const Expected<void, SinkError>& result);
  void send(const RecordBatch& batch);

  std::string path_;
  Extent extent_;
  const SessionNumbering& numbering_;
  SessionPosition& position_;
  std::span<const std::unique_ptr<Sink>> sinks_;
  std::optional<StimulationGate> gate_;  ///< of all sinks; none without electrodes
  std::vector<std::optional<StimulationOutlet>> outlets_;  ///< by sink; none for one that records
  std::size_t electrodes_;
  std::chrono::nanoseconds step_;  ///< between two looks at the clock
  std::optional<SessionReader> session_;
  bool ended_ = false;  ///< the whole file is read
  SessionChunk chunk_;
  RecordLists<Waiting> waiting_;
  /// The blocks before a position that is being gone to, by probe and first taxel: only those that
  /// change are recorded.
  std::map<std::pair<std::uint32_t, std::uint16_t>, TaxelBlock> passed_taxels_;
  std::vector<StimulationCommand> last_commands_;  ///< by electrode, since the last switch-off
  std::chrono::nanoseconds next_flush_{0};         ///< host time
  std::string failure_;
};

}  // namespace merkel
