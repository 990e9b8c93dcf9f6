#pragma once

#include <cstddef>
#include <string>

#include "core/expected.hpp"
#include "tools/scene/scene_file.hpp"
#include "tools/studies/report/report.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// The tables that scorecard() fills.
[[nodiscard]] TableHeads scorecard_tables(const Scene& scene, const Recordings& recordings);

/// Scores a scene against recordings: fills the tables, returns the text.
/// \param data  file of the recordings; empty: the built-in ones
[[nodiscard]] Expected<std::string, SetupError> scorecard(
    const Scene& scene, const Recordings& recordings, const std::string& data, std::size_t trials,
    std::size_t threads, const ReportFolder& folder, ReportTables& tables);

}  // namespace merkel
