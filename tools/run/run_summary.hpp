#pragma once

#include <string>
#include <string_view>

#include "core/scene/tactile_model.hpp"
#include "realtime/pipeline.hpp"
#include "tools/studies/plan/plan.hpp"

namespace merkel {

/// The summary at the end of a run as text. \param plan  the plan that chose the method; null: none
/// \param preset  of the scene: tells to which presses its afferents are fitted
[[nodiscard]] std::string summary_text(const RunReport& report, const TactileModel& model,
                                       const Plan* plan = nullptr, bool all_afferents = false,
                                       std::string_view preset = {});

/// The same as one JSON object.
[[nodiscard]] std::string summary_json(const RunReport& report, const TactileModel& model,
                                       const Plan* plan = nullptr);

}  // namespace merkel
