#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"
#include "realtime/input/contact_decision.hpp"
#include "tools/studies/report/report.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// Loads the traces and spike files of a data file, relative to its folder, and adds the recorded
/// rate of every phase of a press to the data sets, so that fits use them.
/// \param contact  of the traces
[[nodiscard]] Expected<void, SetupError> load_trials(Recordings& recordings,
                                                     const std::string& folder,
                                                     const ContactDecision::Parameters& contact);

/// The tables that score_trials() fills.
inline const TableHeads kTrialTables = {
    {"trials.csv", "set,source,trial,time_s"},
    {"psth.csv", "set,time_s,recorded_hz,model_hz"},
    {"press.csv", "set,unit,time_s,level"},
    {"distances.csv", "set,distance,model_to_recorded,recorded_to_recorded"}};

/// Compares the model's afferent with the recorded ones under every recorded press: rates by phase,
/// PSTH, spike distances and phase locking. Fills trials.csv (all spikes), psth.csv, press.csv and
/// distances.csv.
/// \return Markdown
[[nodiscard]] Expected<std::string, SetupError> score_trials(const TactileModel::Parameters& scene,
                                                             const Recordings& recordings,
                                                             std::size_t repetitions,
                                                             ReportTables& tables);

}  // namespace merkel
