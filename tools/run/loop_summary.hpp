#pragma once

#include <string>

#include "realtime/pipeline.hpp"
#include "tools/json_text.hpp"

namespace merkel {

/// The real-time performance of a run, for the text "loop"; null for a run on the virtual clock.
[[nodiscard]] Json loop_json(const RunReport& report);
/// {count, p50_us, p99_us, p99.9_us, max_us}; null if nothing was measured.
[[nodiscard]] Json latency_json(const LatencySummary& latency);
/// "p50 1.2, p99 3.4, p99.9 5.6, max 7.8 µs".
[[nodiscard]] std::string latency_text(const LatencySummary& latency);

}  // namespace merkel
