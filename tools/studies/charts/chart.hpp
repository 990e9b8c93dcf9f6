#pragma once

#include <string>

#include "core/expected.hpp"
#include "tools/studies/report/report.hpp"

namespace merkel {

/// Each function measures one chart on this machine, as a part of a report.
[[nodiscard]] Expected<std::string, SetupError> make_integrators_chart(const ReportFolder& folder);
[[nodiscard]] Expected<std::string, SetupError> make_contact_chart(const ReportFolder& folder);
[[nodiscard]] Expected<std::string, SetupError> make_solved_contact_chart(
    const ReportFolder& folder);
[[nodiscard]] Expected<std::string, SetupError> make_contact_stability_chart(
    const ReportFolder& folder);
[[nodiscard]] Expected<std::string, SetupError> make_end_to_end_chart(const ReportFolder& folder);
[[nodiscard]] Expected<std::string, SetupError> make_stability_chart(const ReportFolder& folder);
[[nodiscard]] Expected<std::string, SetupError> make_touch_chart(const ReportFolder& folder);

}  // namespace merkel
