#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/encoding/simulation_step.hpp"
#include "core/scene/tactile_model.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "tools/run/replay_comparison.hpp"
#include "tools/run/stimulation_replay.hpp"

namespace merkel {

/// Simulates a recorded session again from its tick inputs and compares every spike with the
/// recorded one: time, neuron, patch and flags.
class SessionReplay {
 public:
  struct Outcome {
    std::uint64_t ticks = 0;
    std::uint64_t spikes = 0;      ///< of the replay
    std::uint64_t commands = 0;    ///< stimulation commands of the replay
    std::uint64_t held_ticks = 0;  ///< ticks with a probe held
    std::uint64_t samples_late = 0;
    std::uint64_t gaps = 0;
    std::uint64_t releases = 0;
    std::uint64_t uncompared = 0;  ///< recorded after the last whole tick
    RunStatus::Losses losses;      ///< what the recorder has lost
    /// Empty if every spike and command equals the recorded one; else the first difference.
    std::string difference;

    [[nodiscard]] bool identical() const { return difference.empty(); }
  };

  /// Callbacks for every tick, in this order; each may be empty.
  struct Callbacks {
    std::function<void(std::span<const SpikeEvent>)> spikes;
    StimulationReplay::Callback commands;
    std::function<void(std::span<const TickRecord>)> ticks;  ///< its inputs, one per probe
  };

  /// \param encoder  fresh; null if the scene has no electrodes
  explicit SessionReplay(TactileModel& model, StimulationEncoder* encoder = nullptr);

  /// Accepts the session's chunks in order.
  void take(const SessionChunk& chunk, const Callbacks& made = {});
  [[nodiscard]] Outcome finish(const Callbacks& made = {});

 private:
  bool take_tick(const TickRecord& record);
  [[nodiscard]] bool take_taxels(const TickRecord& record);
  void differ(std::string sentence);

  TactileModel& model_;
  ReplayComparison<SpikeEvent> spikes_;
  SimulationStep step_;
  StimulationReplay stimulation_;
  std::vector<TickRecord> records_;         ///< of the tick
  std::deque<TaxelBlock> blocks_;           ///< of this tick and later ones
  std::vector<std::vector<float>> taxels_;  ///< pressures of each tactile array, kPa
  std::size_t probe_ = 0;                   ///< expected probe of the next record
  bool held_ = false;
  bool broken_ = false;  ///< a record was lost
  std::optional<TickRecord> last_;
  Outcome verdict_;
};

}  // namespace merkel
