#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "core/scene/tactile_model.hpp"
#include "realtime/pipeline.hpp"
#include "tools/json_text.hpp"

namespace merkel {

/// "thumb" if patches have names, else "probe 2"; empty if it is the only one.
[[nodiscard]] std::string name_of_probe(const TactileModel& model, std::size_t probe);

/// The deepest press of a probe, with what drove it and how far the contact law holds. Quantities
/// that the contact does not have, such as the radius of a flat tip, are null. \param preset  of
/// the scene: tells to which presses its afferents are fitted
[[nodiscard]] Json press_json(const TactileModel& model, std::size_t probe,
                              std::string_view preset);

/// Of a probe that measures both, force and depth at that press beside the model's force; else
/// null.
[[nodiscard]] Json both_json(const RunReport& report, const TactileModel& model, std::size_t probe);

}  // namespace merkel
