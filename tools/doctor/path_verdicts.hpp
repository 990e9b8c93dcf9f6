#pragma once

#include <optional>
#include <vector>

#include "tools/doctor/doctor_verdict.hpp"
#include "tools/doctor/path_measurement.hpp"

namespace merkel {

/// One measurement of the path, followed by cyclictest's if that is installed.
struct DoctorRun {
  PathMeasurement path;
  std::optional<LatencySummary> cyclictest;
};

/// Verdicts on the medians of runs: wake-up latency (99.9 % within 20 µs is good, within 500 µs
/// fair), missed ticks (none is good, 0.1 % fair), software latency (median within 60 µs is good),
/// missing spikes and, if cyclictest ran, whether the loop wakes up as fast.
[[nodiscard]] std::vector<Verdict> path_verdicts(const std::vector<DoctorRun>& runs);

/// The median of each figure of several summaries; counts are summed.
[[nodiscard]] LatencySummary median_of(std::vector<LatencySummary> summaries);

}  // namespace merkel
