#pragma once

#include <string>

#include "core/expected.hpp"
#include "tools/batch/batch_job.hpp"

namespace merkel {

/// A hash of everything that determines the result of a job, the same for `merkel batch` and
/// merkel.batch() in Python.
/// \param scene  the name of a preset, or the whole text of a scene without its sinks
/// \param kept  format of the kept file; empty: none
/// \param more  what only Python gives: the arrays of a press, a function that keeps
[[nodiscard]] std::string batch_id(const BatchJob& job, const std::string& scene,
                                   const std::string& kept, const std::string& more = {});

/// The name of a job's kept file in the folder. Fails for a name that a file cannot have.
[[nodiscard]] Expected<std::string, SetupError> kept_file(const BatchJob& job,
                                                          const std::string& extension);

/// The command that repeats a job.
[[nodiscard]] std::string command_of(const BatchJob& job);

}  // namespace merkel
