#pragma once

#include <string>

#include "core/expected.hpp"
#include "tools/studies/report/report.hpp"

namespace merkel {

/// Each function computes one figure of the paper from this model, as a part of a report.
MakePart make_grating, make_depth_profiles;
/// \param seeds  receptor draws for the statistics
[[nodiscard]] Expected<std::string, SetupError> make_centre_press(const ReportFolder& folder,
                                                                  ReportTables& tables, int seeds);
/// \param seeds  receptor draws
[[nodiscard]] Expected<std::string, SetupError> make_position_scan(const ReportFolder& folder,
                                                                   ReportTables& tables, int seeds);
/// Not in the paper: force against depth for all contact laws; bars on a curved finger, compared
/// with boundary elements.
MakePart make_contact_laws, make_curved_bars;

}  // namespace merkel
