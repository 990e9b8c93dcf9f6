#pragma once

#include <optional>
#include <vector>

#include "tools/doctor/path_measurement.hpp"
#include "tools/doctor/verdict.hpp"

namespace merkel {

/// One measurement of the path, and cyclictest's right after it where it is installed.
struct DoctorRun {
  PathMeasurement path;
  std::optional<LatencySummary> cyclictest;
};

/// Judges the medians of runs: wake-up latency (99.9 % within 20 µs is good, within 500 µs fair),
/// missed ticks (none is good, 0.1 % fair), software latency (median within 60 µs is good), spikes
/// that did not arrive, and, beside cyclictest, whether the loop wakes up as well.
[[nodiscard]] std::vector<Verdict> path_verdicts(const std::vector<DoctorRun>& runs);

/// The median of each figure of several summaries; of the counts, the sum.
[[nodiscard]] LatencySummary median_of(std::vector<LatencySummary> summaries);

}  // namespace merkel
