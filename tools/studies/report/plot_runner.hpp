#pragma once

#include <string>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// True if Debian's Python has a module.
[[nodiscard]] bool python_has(const std::string& module);

/// Runs one of the Python scripts that are built into the program (tools/plots/*.py).
/// \param script  its name without ".py"
[[nodiscard]] Expected<void, SetupError> run_script(const std::string& script,
                                                    const std::vector<std::string>& arguments);

/// Draws the CSV tables of a folder as PNG files in the same folder, with one of the plot scripts
/// that are built into the program (tools/plots/*.py), by Debian's Python with matplotlib.
/// \param script  its name without ".py"
/// Without such a Python, fails with the package to install; the tables remain.
[[nodiscard]] Expected<void, SetupError> draw_plots(const std::string& script,
                                                    const std::string& folder);

}  // namespace merkel
