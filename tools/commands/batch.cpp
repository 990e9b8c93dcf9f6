#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "drivers/files/input_file.hpp"
#include "tools/batch/batch_folder.hpp"
#include "tools/batch/batch_job.hpp"
#include "tools/batch/batch_workers.hpp"
#include "tools/commands/command.hpp"
#include "tools/run/stop_signal.hpp"
#include "tools/run/terminal_line.hpp"

namespace merkel {
namespace {

struct BatchOptions {
  std::vector<std::string> jobs;
  std::string out;
  std::string keep = "table";
  std::optional<double> processes;
  bool strict = false;
};

Expected<TextTable, SetupError> read_table(const std::vector<std::string>& paths) {
  if (are_sessions(paths)) return session_jobs(paths);
  const std::string& path = paths.front();
  constexpr std::size_t kMaxBytes = std::size_t{1} << 28U;
  const auto text = read_whole_file(path, "table of jobs", kMaxBytes);
  if (!text) return Unexpected<SetupError>(text.error());
  return parse_table(*text, path);
}

/// Runs the jobs that have no result yet. \return whether all were run
Expected<bool, SetupError> run_missing(const BatchOptions& options, const BatchKeep& keep,
                                       const std::vector<BatchJob>& jobs, BatchFolder& folder) {
  std::vector<const BatchJob*> missing;
  std::set<std::string> seen;
  for (const BatchJob& job : jobs) {
    if (folder.finished(job.id).is_null() && seen.insert(job.id).second) missing.push_back(&job);
  }
  if (missing.empty()) return true;
  std::atomic<bool> stopped{false};
  const StopSignal stop(stopped);
  TerminalLine terminal;
  ModelCache models;  // of each worker: it is empty when they start
  SharedWork work;
  work.items = missing.size();
  work.processes = jobs_or_cores(options.processes);
  work.run = [&](std::size_t item) {
    const BatchJob& job = *missing[item];
    const Json outcome = run_batch_job(job, keep, models);
    if (outcome.is_null()) return false;
    if (folder.add(job.id, outcome)) return true;
    std::fprintf(stderr, "merkel: cannot write %s/rows.jsonl: %s; make room there\n",
                 options.out.c_str(), std::strerror(errno));
    return false;
  };
  work.on_death = [&](std::size_t item, const std::string& reason) {
    static_cast<void>(folder.add(missing[item]->id, {{"status", "failed"}, {"error", reason}}));
  };
  work.on_progress = [&](std::size_t finished) {
    terminal.show({std::to_string(jobs.size() - missing.size() + finished) + " of " +
                   std::to_string(jobs.size()) + " jobs"});
  };
  const auto finished = run_shared(work, stopped);
  terminal.clear();
  if (!finished) return Unexpected<SetupError>(finished.error());
  return *finished == missing.size();
}

int batch(const BatchOptions& options) {
  const auto keep = keep_in(options.out, options.keep);
  if (!keep) return refuse(keep.error());
  const auto table = read_table(options.jobs);
  if (!table) return refuse(table.error());
  const auto jobs = jobs_of(*table, *keep);
  if (!jobs) return refuse(jobs.error());
  if (std::ranges::any_of(*jobs, &BatchJob::has_sinks)) {
    warn(
        "note: a batch does not open the sinks of its scenes, since all jobs would write to them: "
        "--keep FORMAT writes a file for each job");
  }
  auto folder = BatchFolder::open(options.out, *jobs);
  if (!folder) return refuse(folder.error());
  const auto complete = run_missing(options, *keep, *jobs, *folder);
  if (!complete) return refuse(complete.error());
  folder->refresh();
  if (auto written = folder->write_table(*table, *jobs); !written) {
    return refuse(written.error());
  }
  std::size_t done = 0;
  std::size_t failed = 0;
  std::size_t doubtful = 0;
  std::string first;
  for (std::size_t i = 0; i < jobs->size(); ++i) {
    const Json* const outcome = folder->outcome((*jobs)[i].id);
    if (outcome == nullptr) continue;
    if (outcome->at("status") == "done") {
      ++done;
      doubtful += outcome->value("verdict", "ok") != "ok" ? 1 : 0;
    } else if (failed++ == 0) {
      first = "job " + std::to_string(i) + ": " + outcome->value("error", "");
    }
  }
  std::fprintf(stderr, "%zu of %zu jobs done, %zu failed; %s/results.csv\n", done, jobs->size(),
               failed, options.out.c_str());
  if (!*complete) return fail("stopped: the same command runs the jobs that are left");
  if (failed > 0) return fail(first);
  return options.strict && doubtful > 0 ? kFailed : kDone;
}

}  // namespace

void add_batch_command(CommandLine& program) {
  auto options = std::make_shared<BatchOptions>();
  program
      .subcommand("batch",
                  "Runs a table of jobs, or the presses of sessions again, on all cores, as fast "
                  "as possible, and writes a table of results: counts, rates, verdict and a hash "
                  "of the spikes, one row per job. Stopped or killed, the same command runs the "
                  "jobs that are left.",
                  "batch jobs.csv --out results")
      .list("inputs", options->jobs,
            "CSV file, one line per job. Columns: scene (preset or file; default paper), probe "
            "(URI), seed, duration_s, name, and any keys of the scene, such as skin.radius_mm or "
            "probe[1].x_mm (merkel scene --keys). An empty cell keeps the scene's value. Or "
            "sessions, or folders of sessions: one job each, the press through the scene that the "
            "session holds, with the session's name")
      .required()
      .option("--out", options->out,
              "Folder of results.csv, of rows.jsonl (the finished jobs) and of kept files")
      .required()
      .option("--keep", options->keep,
              "Also write each run to a file in the folder: nwb, xdf, csv, sonata or gdf; default "
              "table: only the row")
      .option("--jobs", options->processes, "Number of processes; default: one per core", {1, 1024})
      .flag("--strict", options->strict, "Also exit with 1 if the verdict of a run is not ok")
      .runs([options] { return batch(*options); });
}

}  // namespace merkel
