#pragma once

#include <string>

#include "core/expected.hpp"
#include "tools/studies/report/report.hpp"

namespace merkel {

/// Each function computes one figure of the paper from this model, as a part of a report.
[[nodiscard]] Expected<std::string, SetupError> make_grating(const ReportFolder& options);
[[nodiscard]] Expected<std::string, SetupError> make_depth_profiles(const ReportFolder& options);
/// \param seeds  receptor draws for the statistics
[[nodiscard]] Expected<std::string, SetupError> make_centre_press(const ReportFolder& options,
                                                                  int seeds);
/// \param seeds  receptor draws
[[nodiscard]] Expected<std::string, SetupError> make_position_scan(const ReportFolder& options,
                                                                   int seeds);
/// Not in the paper: force against depth for all contact laws.
[[nodiscard]] Expected<std::string, SetupError> make_contact_laws(const ReportFolder& options);
/// Not in the paper: bars on a curved finger, compared with boundary elements.
[[nodiscard]] Expected<std::string, SetupError> make_curved_bars(const ReportFolder& options);

}  // namespace merkel
