#pragma once

#include <string>

#include "core/expected.hpp"

namespace merkel {

/// Draws the CSV tables of a folder as PNG files beside them, with one of the plot scripts that
/// are built into the program (tools/plots/*.py), run by Debian's Python with matplotlib.
/// \param script  its name without ".py"
/// Fails, with what to install, where there is no such Python; the tables are there all the same.
[[nodiscard]] Expected<void, SetupError> draw_plots(const std::string& script,
                                                    const std::string& folder);

}  // namespace merkel
