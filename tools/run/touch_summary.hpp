#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "core/scene/tactile_model.hpp"
#include "realtime/pipeline.hpp"
#include "tools/json_text.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {

/// "thumb" if patches have names, else "probe 2"; empty if it is the only one.
[[nodiscard]] std::string name_of_probe(const TactileModel& model, std::size_t probe);

/// How the level of a probe at rest changed; null if its zero was not measured at rest.
[[nodiscard]] Json drift_json(const ContactDecision::Drift& drift);

/// The deepest press of a probe, with what drove it and how far the contact law holds. Quantities
/// that the contact does not have, such as the radius of a flat tip, are null. \param preset  of
/// the scene: tells to which presses its afferents are fitted
[[nodiscard]] Json press_json(const TactileModel& model, std::size_t probe,
                              std::string_view preset);

/// What the rates rest on: what drives the probes, their presses beside those of the fit, the law
/// of the skin, and the drift of their zeros. One entry for all probes for which these are the
/// same. \param report  of the run; null: of a plan
[[nodiscard]] Json validity_json(const Scene& scene, const TactileModel& model,
                                 const RunReport* report = nullptr);

/// Of a probe that measures both, force and depth at that press beside the model's force; else
/// null.
[[nodiscard]] Json both_json(const RunReport& report, const TactileModel& model, std::size_t probe);

}  // namespace merkel
