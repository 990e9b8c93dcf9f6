#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "realtime/queues/latency_histogram.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {

/// Measures this host's wake-up latency with the program cyclictest, under the rights of the
/// simulation thread. Empty if cyclictest is not installed.
[[nodiscard]] std::optional<LatencySummary> run_cyclictest(std::chrono::nanoseconds duration,
                                                           std::chrono::nanoseconds interval,
                                                           const RealtimeRights& rights);

/// Reads the output of `cyclictest --json`: its first thread's histogram, in whole microseconds.
/// Empty if the text is not such output.
[[nodiscard]] std::optional<LatencySummary> parse_cyclictest(const std::string& json);

}  // namespace merkel
