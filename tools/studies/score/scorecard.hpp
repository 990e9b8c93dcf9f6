#pragma once

#include <cstddef>
#include <string>

#include "core/expected.hpp"
#include "tools/scene/scene_file.hpp"
#include "tools/studies/report/report.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// Scores a scene against recordings: writes the tables, returns the text.
/// \param data  file of the recordings; empty: the built-in ones
[[nodiscard]] Expected<std::string, SetupError> scorecard(const Scene& scene,
                                                          const Recordings& recordings,
                                                          const std::string& data,
                                                          std::size_t trials, std::size_t threads,
                                                          const ReportFolder& folder);

}  // namespace merkel
