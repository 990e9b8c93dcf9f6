#pragma once

#include <string>

#include "core/scene/tactile_model.hpp"
#include "realtime/pipeline.hpp"
#include "tools/json_text.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// All that a run's summary says. \param plan  prediction_json() of the plan that chose the method;
/// null: none
[[nodiscard]] Json summary_json(const RunReport& report, const TactileModel& model,
                                const Json& plan, const Scene& scene);

/// The same as text, with all counters that are not 0. \param all_afferents  false: the ten most
/// active
[[nodiscard]] std::string summary_text(Json summary, bool all_afferents);

}  // namespace merkel
