#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/report/report.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// Reads the traces and spike files that a data file names, relative to its folder, and adds the
/// recorded rate of every phase of a press to the data sets, so that a fit uses them too.
[[nodiscard]] Expected<void, SetupError> load_trials(Recordings& recordings,
                                                     const std::string& folder);

/// Rates by phase, PSTH, spike distances and phase locking of the model's afferent under every
/// recorded press, beside the recorded ones. Writes trials.csv (all spikes), psth.csv and
/// press.csv. Text: Markdown.
[[nodiscard]] Expected<std::string, SetupError> score_trials(const TactileModel::Parameters& scene,
                                                             const Recordings& recordings,
                                                             std::size_t repetitions,
                                                             const ReportFolder& folder);

}  // namespace merkel
