#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "core/encoding/stimulation_encoder.hpp"
#include "tools/run/replay_comparison.hpp"

namespace merkel {

/// Encodes the ticks of a recorded session again, and compares every stimulation command with the
/// recorded one, bit for bit. A failure of a sink and the drives of an encoder of the user's own
/// are external inputs: the replay takes them from the recording.
class StimulationReplay {
 public:
  using Callback = std::function<void(std::span<const StimulationCommand>)>;

  /// \param encoder  fresh; null if the scene has no electrodes
  explicit StimulationReplay(StimulationEncoder* encoder);

  /// Adds recorded commands and drives, before their ticks.
  void take(std::span<const StimulationCommand> recorded, std::span<const GivenDrive> drives) {
    comparison_.expect(recorded);
    drives_.insert(drives_.end(), drives.begin(), drives.end());
  }
  /// Before the encoder's step of the tick that ends at `time`.
  void prepare(std::chrono::nanoseconds time);
  /// The commands of that step. \param made  receives them; may be empty
  void compare(std::span<const StimulationCommand> commands, const Callback& made);
  /// After the last tick: the last update, if the recording has it.
  void finish(const Callback& made);

  [[nodiscard]] std::uint64_t commands() const noexcept { return comparison_.made(); }
  /// Empty if every command equals the recorded one; else the first difference, as a sentence.
  [[nodiscard]] const std::string& difference() const noexcept { return comparison_.difference(); }

 private:
  StimulationEncoder* encoder_;
  ReplayComparison<StimulationCommand> comparison_;
  std::deque<GivenDrive> drives_;                 ///< of later ticks
  std::optional<std::chrono::nanoseconds> last_;  ///< end of the last tick
};

}  // namespace merkel
