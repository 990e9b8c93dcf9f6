#pragma once

#include <chrono>
#include <vector>

#include "tools/studies/plan/plan.hpp"

namespace merkel {

/// The methods, precisions and steps that may meet a budget for the spike-time error and divide the
/// tick, cheapest first. Costs and errors come from a table that `merkel chart` measures.
[[nodiscard]] std::vector<PlanOption> options_by_cost(std::chrono::nanoseconds tick,
                                                      double budget_us);

}  // namespace merkel
