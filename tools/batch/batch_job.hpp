#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "tools/batch/text_table.hpp"
#include "tools/json_text.hpp"
#include "tools/scene/prepared_run.hpp"
#include "tools/scene/scene_overrides.hpp"

namespace merkel {

/// One run of a batch: a line of the jobs' table.
struct BatchJob {
  std::string id = {};     ///< a hash of everything that determines its result, files included
  std::string scene = {};  ///< preset or file
  std::string name = {};   ///< of its kept file; empty: the id
  std::string file = {};   ///< kept, in the folder; empty: none
  std::string probe = {};  ///< URI; empty: the scene's
  std::optional<std::uint64_t> seed = std::nullopt;
  std::optional<double> duration_s = std::nullopt;
  SceneOverrides overrides = {};
  bool has_sinks = false;  ///< whether its scene has sinks, which it does not open
  std::string error = {};  ///< why it cannot run; empty: it can
};

/// What becomes of the runs of a batch.
struct BatchKeep {
  static constexpr const char* kTable = "results.csv";  ///< of all jobs, in the folder

  std::string folder;
  std::string format;     ///< scheme of a file sink; empty: only the row of the table
  std::string extension;  ///< of its files
};
/// Of a format's name. Fails with the known ones.
[[nodiscard]] Expected<BatchKeep, SetupError> keep_in(const std::string& folder,
                                                      const std::string& format);

/// The jobs of a table with the columns scene, probe, seed, duration_s and name, and keys of scenes
/// such as skin.radius_mm; an empty cell keeps the scene's own value. Fails where a column is none
/// of these or occurs twice, and where two different jobs would keep files of the same name.
[[nodiscard]] Expected<std::vector<BatchJob>, SetupError> jobs_of(const TextTable& table,
                                                                  const BatchKeep& keep);

/// Whether the jobs of a batch are sessions, not a table.
[[nodiscard]] bool are_sessions(const std::vector<std::string>& paths);

/// A table of jobs, one for each session: its press through the scene that it holds, for its
/// duration and under its name. \param paths  sessions, and folders whose sessions (*.xdf) are
/// taken by name. Fails for a path that is neither and for a folder without sessions.
[[nodiscard]] Expected<TextTable, SetupError> session_jobs(const std::vector<std::string>& paths);

/// The columns of the result table after those of the jobs.
[[nodiscard]] const std::vector<std::string>& outcome_columns();

/// Removes the sinks of a scene: all jobs of a batch would write to them. \return whether it had
/// any
bool drop_sinks(Scene& scene);

/// Runs a job as `merkel run --fast` does, without the sinks of its scene. \return its outcome by
/// column; with status "failed" and the error where it fails; null if it was interrupted (SIGINT,
/// SIGTERM)
[[nodiscard]] Json run_batch_job(const BatchJob& job, const BatchKeep& keep, ModelCache& models);

}  // namespace merkel
