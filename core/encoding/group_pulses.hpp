#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/encoding/encoding_parameters.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/stimulation_command.hpp"

namespace merkel {

/// Turns the trains of groups into single pulses: the electrodes of a group pulse in turn, evenly
/// spaced, at one frequency.
///
/// With n electrodes at a frequency f, the next electrode pulses 1/(nf) after the last, with the
/// frequency of the last update. The first pulse after a pause comes at once. Real-time: yes, after
/// construction. Deterministic.
class GroupPulses {
 public:
  explicit GroupPulses(const EncodingParameters& parameters);

  void reset() noexcept MERKEL_REALTIME;
  /// Keeps the trains of groups and switches them off in the update, except invalid ones.
  void take(std::span<StimulationCommand> update) noexcept MERKEL_REALTIME;
  /// Switches off the groups on patches that have a stop. \param stops  by patch
  void stop(std::span<const StimulationCommand::Stop> stops) noexcept MERKEL_REALTIME;
  /// Writes the pulses of a tick (begin, end] behind the first `count` commands and sorts all by
  /// time. At most one for each group. \return the number of commands
  [[nodiscard]] std::size_t append(std::span<StimulationCommand> commands, std::size_t count,
                                   std::chrono::nanoseconds begin, std::chrono::nanoseconds end,
                                   std::uint32_t heartbeat) noexcept MERKEL_REALTIME;

 private:
  struct Group {
    std::size_t patch = 0;
    std::vector<std::uint16_t> electrodes;
    std::size_t turn = 0;
    std::optional<std::chrono::nanoseconds> interval;  ///< between pulses; none: off
    std::optional<std::chrono::nanoseconds> last;
  };
  std::vector<Group> groups_;
  std::vector<double> amplitude_uA_;  ///< by electrode
};

}  // namespace merkel
