#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "core/records/stimulation_command.hpp"

namespace merkel {

/// A stimulation command that has passed the gate of a run, as all receivers get it: plain data
/// that crosses threads. Times are host-monotonic.
struct SentCommand {
  StimulationCommand command;
  /// When it passed the gate. 0: on a virtual clock, where nothing acts on commands.
  std::chrono::nanoseconds sent{0};
  /// A receiver that has nothing newer by then switches the electrode off by itself.
  std::chrono::nanoseconds valid_until{0};
  /// 0: it left. n: the n-th sink of the run, in the order of the command line from 1, did not pass
  /// it on, because the sink or its receiver was late or away.
  std::uint32_t refused_by = 0;

  friend bool operator==(const SentCommand&, const SentCommand&) = default;
};

static_assert(std::is_trivially_copyable_v<SentCommand>);

/// Commands for receivers that act on none, as where a recording is simulated again.
[[nodiscard]] inline std::vector<SentCommand> unsent_of(
    std::span<const StimulationCommand> commands) {
  std::vector<SentCommand> unsent;
  for (const StimulationCommand& command : commands) unsent.push_back({.command = command});
  return unsent;
}

}  // namespace merkel
