#pragma once

#include <string>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// Whether Debian's Python has a module.
[[nodiscard]] bool python_has(const std::string& module);

/// Runs one of the Python scripts that are built into the program (tools/plots/*.py).
/// \param script  its name without ".py"
[[nodiscard]] Expected<void, SetupError> run_script(const std::string& script,
                                                    const std::vector<std::string>& arguments);

/// Draws the CSV tables of a folder as PNG files beside them, with one of the plot scripts that
/// are built into the program (tools/plots/*.py), run by Debian's Python with matplotlib.
/// \param script  its name without ".py"
/// Fails, with what to install, where there is no such Python; the tables are there all the same.
[[nodiscard]] Expected<void, SetupError> draw_plots(const std::string& script,
                                                    const std::string& folder);

}  // namespace merkel
