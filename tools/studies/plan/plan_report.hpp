#pragma once

#include <string>

#include "tools/studies/plan/plan.hpp"

namespace merkel {

/// "crank_nicolson in double at 25 µs".
[[nodiscard]] std::string name_of_option(const PlanOption& option);

[[nodiscard]] std::string plan_text(const Plan& plan);
[[nodiscard]] std::string plan_json(const Plan& plan);

}  // namespace merkel
