#include "tools/batch/batch_job.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <system_error>

#include <fmt/core.h>

#include "core/parameters/field.hpp"
#include "core/parameters/nearest_name.hpp"
#include "core/records/spike_hash.hpp"
#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/parsed_number.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sessions/session_samples.hpp"
#include "realtime/output/spike_callback.hpp"
#include "tools/batch/batch_identity.hpp"
#include "tools/run/stop_signal.hpp"
#include "tools/run/verdict.hpp"
#include "tools/scene/machine_facts.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/scene/session_scene.hpp"
#include "tools/studies/plan/plan.hpp"

namespace merkel {
namespace {

const std::vector<std::string>& job_columns() {
  static const std::vector<std::string> columns = {"scene", "probe", "seed", "duration_s", "name"};
  return columns;
}

/// The scenes of jobs, each read once.
class JobScenes {
 public:
  struct JobScene {
    std::string identity;  ///< the name of a preset, or the scene_identity() without sinks
    bool has_sinks = false;
  };

  const JobScene& operator()(const std::string& name_or_file) {
    const auto [at, added] = known_.try_emplace(name_or_file, JobScene{.identity = name_or_file});
    if (added && !preset_scene(name_or_file)) {
      if (auto scene = scene_named(name_or_file)) {
        at->second.has_sinks = drop_sinks(*scene);
        at->second.identity = scene_identity(*scene);
      }
    }
    return at->second;
  }

 private:
  std::map<std::string, JobScene> known_;
};

void set_cell(const std::string& column, const std::string& cell, BatchJob& job) {
  if (cell.empty()) return;
  const auto number = parse_number(cell);
  if (column == "scene") {
    job.scene = cell;
  } else if (column == "name") {
    job.name = cell;
  } else if (column == "probe") {
    job.probe = cell;
  } else if (column == "seed") {
    // Also 7.0: other programs write whole numbers of a table so.
    const bool whole = number && *number == std::floor(*number) && std::fabs(*number) < 9e15;
    job.seed = parsed_number<std::uint64_t>(whole ? fmt::format("{:.0f}", *number) : cell);
    if (!job.seed || *job.seed > kMaxSeed) {
      job.error =
          fmt::format("seed must be a whole number from 0 to {}, but is {}", kMaxSeed, cell);
    }
  } else if (column == "duration_s") {
    if (!number || !(*number >= 1e-6 && *number <= 1e9)) {
      job.error = "duration_s must be a number of seconds from 1e-6 to 1e9, but is " + cell;
    } else {
      job.duration_s = *number;
    }
  } else {
    job.overrides.emplace_back(column, cell);
  }
}

Json failure(const std::string& sentence) { return {{"status", "failed"}, {"error", sentence}}; }

Expected<PreparedRun, SetupError> prepare(const BatchJob& job, ModelCache& models) {
  auto base = scene_named(job.scene);
  if (!base) return Unexpected<SetupError>(base.error());
  drop_sinks(*base);
  auto scene = with_overrides(*base, job.overrides);
  if (!scene) return Unexpected<SetupError>(scene.error());
  if (!job.probe.empty()) {
    if (auto set = set_probes(*scene, {job.probe}); !set)
      return Unexpected<SetupError>(set.error());
  }
  if (job.seed) scene->set_seed(*job.seed);
  scene->loop.threads = 1;  // the jobs share the cores; the spikes are the same
  if (scene->spike_time_us) {
    if (auto plan = make_plan(*scene); !plan) return Unexpected<SetupError>(plan.error());
  }
  auto run = prepare_run(std::move(*scene), {.fast = true, .models = &models});
  if (run && job.duration_s) {
    run->parameters.duration = units::nanoseconds_from_s(*job.duration_s);
  }
  return run;
}

bool is_folder(const std::string& path) {
  std::error_code failed;
  return std::filesystem::is_directory(path, failed);
}

std::vector<std::string> sessions_in(const std::string& folder) {
  std::vector<std::string> sessions;
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failed)) {
    if (entry.path().extension() == ".xdf") sessions.push_back(entry.path().string());
  }
  std::ranges::sort(sessions);
  return sessions;
}

/// The duration of a recorded run, s; empty for a recording without ticks.
std::string duration_of(const std::string& path) {
  auto session = SessionReader::open(path);
  if (!session) return {};
  session->read_only({SessionStream::Id::kTicks});
  std::uint64_t ticks = 0;
  static_cast<void>(session->for_each([&](const SessionChunk& chunk) {
    if (!chunk.ticks.empty()) ticks = chunk.ticks.back().number;
  }));
  const auto tick_ns = parse_number(session->fact("tick_ns"));
  return tick_ns && ticks > 0 ? shortest_decimal(static_cast<double>(ticks) * *tick_ns / 1e9) : "";
}

double rounded(double value) { return std::round(value * 1e6) / 1e6; }

}  // namespace

Expected<BatchKeep, SetupError> keep_in(const std::string& folder, const std::string& format) {
  const std::vector<std::pair<std::string, std::string>> known = {{"table", ""},    {"nwb", "nwb"},
                                                                  {"xdf", "xdf"},   {"csv", "csv"},
                                                                  {"sonata", "h5"}, {"gdf", "gdf"}};
  for (const auto& [name, extension] : known) {
    if (name == format) return BatchKeep{folder, extension.empty() ? "" : name, extension};
  }
  return bad_input("--keep " + format + " is not one of " +
                   listed(known, [](const auto& each) { return each.first; }));
}

Expected<std::vector<BatchJob>, SetupError> jobs_of(const TextTable& table, const BatchKeep& keep) {
  std::set<std::string> columns;
  for (const std::string& column : table.columns) {
    const auto& known = job_columns();
    if (!columns.insert(column).second) {
      return bad_input("the jobs have two columns \"" + column + "\": remove one, or rename it");
    }
    if (column.find('.') != std::string::npos ||
        std::find(known.begin(), known.end(), column) != known.end()) {
      continue;
    }
    return bad_input("the jobs have a column \"" + column + "\"" +
                     did_you_mean(column, known,
                                  ": the columns are scene, probe, seed, duration_s, name "
                                  "and keys of scenes such as skin.radius_mm"));
  }
  std::vector<BatchJob> jobs;
  std::map<std::string, std::string> names;  // of kept files, with the job of each
  JobScenes scenes;
  for (const auto& row : table.rows) {
    BatchJob job{.scene = "paper"};
    for (std::size_t i = 0; i < row.size(); ++i) set_cell(table.columns[i], row[i], job);
    const auto& scene = scenes(job.scene);
    job.has_sinks = scene.has_sinks;
    job.id = batch_id(job, scene.identity, keep.format);
    if (!keep.format.empty()) {
      auto file = kept_file(job, keep.extension);
      if (!file) return Unexpected<SetupError>(file.error());
      job.file = std::move(*file);
      if (names.try_emplace(job.file, job.id).first->second != job.id) {
        return bad_input("two different jobs have the name \"" + job.name +
                         "\", but each keeps a file of its name: give them different names");
      }
    }
    jobs.push_back(std::move(job));
  }
  return jobs;
}

bool are_sessions(const std::vector<std::string>& paths) {
  return paths.size() > 1 || is_folder(paths.front()) || SessionSamples::is_session(paths.front());
}

Expected<TextTable, SetupError> session_jobs(const std::vector<std::string>& paths) {
  TextTable jobs{.columns = {"scene", "probe", "duration_s", "name"}};
  for (const std::string& path : paths) {
    const bool folder = is_folder(path);
    const auto sessions = folder ? sessions_in(path) : std::vector<std::string>{path};
    if (sessions.empty()) return bad_input("the folder " + path + " holds no session (*.xdf)");
    for (const std::string& session : sessions) {
      if (!folder && !SessionSamples::is_session(session)) {
        return bad_input(session +
                         " is neither a session (XDF) nor a folder of sessions: a table of jobs "
                         "stands alone");
      }
      std::string name = std::filesystem::path(session).filename().string();
      if (const auto end = name.rfind(".xdf"); end != std::string::npos) name.erase(end, 4);
      jobs.rows.push_back({session, "replay:" + session, duration_of(session), name});
    }
  }
  return jobs;
}

const std::vector<std::string>& outcome_columns() {
  static const std::vector<std::string> columns = {
      "status",  "error",   "spikes",     "firing", "rate_hz", "busiest_hz", "simulated_s",
      "verdict", "version", "spike_hash", "file",   "run_s",   "command"};
  return columns;
}

bool drop_sinks(Scene& scene) {
  const bool any = !scene.sinks.empty();
  scene.sinks.clear();
  return any;
}

Json run_batch_job(const BatchJob& job, const BatchKeep& keep, ModelCache& models) {
  const auto begin = std::chrono::steady_clock::now();
  if (!job.error.empty()) return failure(job.error);
  auto run = prepare(job, models);
  if (!run) return failure(run.error().sentence);
  const TactileModel& model = *run->model;
  std::vector<std::string> sinks;
  if (!job.file.empty()) sinks.push_back(keep.format + ":" + keep.folder + "/" + job.file);
  // BatchFolder::open has refused the files of others.
  const auto made = run->pipeline_to(sinks, {.overwrite = true});
  if (!made) return failure(made.error().sentence);
  Pipeline& pipeline = **made;
  SpikeHash hash;
  pipeline.add_sink(std::make_unique<SpikeCallback>(
      "hash", [&](std::span<const SpikeEvent> spikes) { hash.add(spikes); }));
  bool stopped = false;
  Expected<RunReport, SetupError> report = [&] {
    const StopSignal stop(pipeline);
    sigset_t ending;
    sigset_t before;
    sigemptyset(&ending);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&ending, signal);
    ::pthread_sigmask(SIG_UNBLOCK, &ending, &before);
    auto done = pipeline.run();
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
    stopped = stop.requested();
    return done;
  }();
  if (stopped && (!report || report->interrupted)) return {};
  if (const std::string error = failure_of(report); !error.empty()) return failure(error);
  const auto& counts = report->spikes_of_neuron;
  const double span_s = std::max(units::s_from(report->simulated), 1e-9);
  const auto busiest = counts.empty() ? 0 : *std::max_element(counts.begin(), counts.end());
  const auto silent = std::count(counts.begin(), counts.end(), 0U);
  const auto afferents = static_cast<double>(std::max<std::size_t>(1, counts.size()));
  Json outcome = {{"status", "done"},
                  {"error", ""},
                  {"spikes", report->spikes},
                  {"firing", counts.size() - static_cast<std::size_t>(silent)},
                  {"rate_hz", rounded(static_cast<double>(report->spikes) / afferents / span_s)},
                  {"busiest_hz", rounded(static_cast<double>(busiest) / span_s)},
                  {"simulated_s", units::s_from(report->simulated)},
                  {"verdict", findings_text(verdict_of(*report, model))},
                  {"version", std::string(MERKEL_VERSION) + " " + kGitHash},
                  {"spike_hash", hash.text()},
                  {"file", job.file},
                  {"command", command_of(job)}};
  models.keep(run->model_key, std::move(run->model));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  outcome["run_s"] = rounded(took.count());
  return outcome;
}

}  // namespace merkel
