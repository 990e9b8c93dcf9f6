#pragma once

#include <string>

#include "core/expected.hpp"
#include "tools/batch/batch_job.hpp"

namespace merkel {

/// The whole text of a scene, with a hash of the heights of each measured shape: a session holds
/// them itself.
[[nodiscard]] std::string scene_identity(const Scene& scene);

/// A hash of everything that determines the result of a job, the same for `merkel batch` and
/// merkel.batch() in Python.
/// \param scene  the name of a preset, or the scene_identity() of a scene without its sinks
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
