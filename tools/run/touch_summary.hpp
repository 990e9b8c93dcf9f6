#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "core/scene/tactile_model.hpp"
#include "realtime/pipeline.hpp"
#include "tools/json_text.hpp"

namespace merkel {

/// The deepest press of a probe, with what drove it and how far the contact law holds.
/// \param preset  of the scene
[[nodiscard]] std::string touch_text(const RunReport& report, const TactileModel& model,
                                     std::size_t probe, std::string_view preset);

/// The same press. Quantities that the contact does not have, such as the radius of a flat tip, are
/// null.
[[nodiscard]] Json press_json(const TactileModel& model, std::size_t probe);

/// Of a probe that measures both, force and depth at that press beside the model's force; else
/// null.
[[nodiscard]] Json both_json(const RunReport& report, const TactileModel& model, std::size_t probe);

}  // namespace merkel
