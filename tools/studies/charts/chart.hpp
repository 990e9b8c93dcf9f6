#pragma once

#include "tools/studies/report/report.hpp"

namespace merkel {

/// Each function measures one chart on this machine, as a part of a report.
MakePart make_integrators_chart, make_contact_chart, make_solved_contact_chart,
    make_contact_stability_chart, make_end_to_end_chart, make_stability_chart, make_touch_chart;

}  // namespace merkel
