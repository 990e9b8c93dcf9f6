#pragma once

#include <string>

#include "core/scene/tactile_model.hpp"
#include "realtime/pipeline.hpp"

namespace merkel {

/// The end-of-run summary for people.
[[nodiscard]] std::string summary_text(const RunReport& report, const TactileModel& model);

/// The same as JSON, for programs: one object.
[[nodiscard]] std::string summary_json(const RunReport& report, const TactileModel& model);

}  // namespace merkel
