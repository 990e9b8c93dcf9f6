#pragma once

#include <string>

#include "tools/json_text.hpp"
#include "tools/studies/plan/plan.hpp"

namespace merkel {

/// "crank_nicolson in double at 25 µs".
[[nodiscard]] std::string name_of_option(const PlanOption& option);

/// All that a plan says, for the text "plan".
[[nodiscard]] Json plan_json(const Plan& plan);
/// What a run's summary says of its plan.
[[nodiscard]] Json prediction_json(const Plan& plan);

}  // namespace merkel
