#pragma once

#include <nlohmann/json.hpp>

#include "drivers/sinks/afferent_table.hpp"

namespace merkel {

/// Converts afferents to JSON and back.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(AfferentRow, number, patch, x_mm, y_mm, field_radius_mm,
                                   receptors)

}  // namespace merkel
