#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "realtime/loop/latency_histogram.hpp"
#include "realtime/threads/thread_setup.hpp"

namespace merkel {

/// Measures this host's wake-up latency by the program cyclictest, under the rights that the
/// simulation got. Nothing where it is not installed.
[[nodiscard]] std::optional<LatencySummary> run_cyclictest(std::chrono::nanoseconds duration,
                                                           std::chrono::nanoseconds interval,
                                                           const RealtimeRights& rights);

/// Reads what `cyclictest --json` wrote: its first thread's histogram, in whole microseconds.
/// Nothing where the text is something else.
[[nodiscard]] std::optional<LatencySummary> parse_cyclictest(const std::string& json);

}  // namespace merkel
