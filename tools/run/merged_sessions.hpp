#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/sink.hpp"
#include "drivers/sinks/sink_setup.hpp"

namespace merkel {

/// Sessions of several rigs on one clock: that of the first session. Neurons, patches, probes and
/// electrodes are numbered through all sessions, in their order.
struct MergedSessions {
  RecordLists<RecordVector> records;  ///< spikes, commands, events, marks and samples
  std::uint32_t neurons = 0;
  std::uint32_t probes = 0;
  RunDescription run;
  RunOrigin origin;
  bool complete = true;  ///< no recording broke off

  /// How a session's clock was placed on that of the first.
  struct Alignment {
    std::string session;
    std::chrono::nanoseconds offset{0};  ///< added to its times
    /// What is left: the uncertainty of the hosts' clocks, or the largest distance of two shared
    /// marks. Empty: unknown.
    std::optional<std::chrono::nanoseconds> residual;
    std::string how;  ///< for the user
  };
  std::vector<Alignment> alignments;  ///< of all sessions but the first
};

/// Reads sessions and aligns them by the UTC time that their hosts recorded, or by the marks with a
/// label, whose mean distance is the offset. \param mark  empty: by UTC
[[nodiscard]] Expected<MergedSessions, SetupError> merge_sessions(
    const std::vector<std::string>& paths, const std::string& mark);

/// Writes everything that a sink takes, in order of time, and closes it.
[[nodiscard]] Expected<void, SinkError> write_merged(const MergedSessions& merged, Sink& sink);

}  // namespace merkel
