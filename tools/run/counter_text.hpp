#pragma once

#include <string>

#include "core/records/run_counters.hpp"
#include "tools/json_text.hpp"

namespace merkel {

/// The counters of add_counters() as text: one line with unit and meaning for each that is not 0.
[[nodiscard]] std::string counter_text(const Json& counters);

/// "  3 overruns  21 skipped ticks": the faults so far on one line; empty without faults.
[[nodiscard]] std::string fault_text(const RunCounters& counters);

/// Adds every counter to a JSON object, under its name.
void add_counters(Json& json, const RunCounters& counters);

}  // namespace merkel
