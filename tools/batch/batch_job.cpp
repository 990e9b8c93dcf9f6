#include "tools/batch/batch_job.hpp"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <system_error>

#include "core/parameters/nearest_name.hpp"
#include "core/records/spike_hash.hpp"
#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/files/example_file.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "realtime/output/spike_callback.hpp"
#include "tools/run/stop_signal.hpp"
#include "tools/run/verdict.hpp"
#include "tools/scene/machine_facts.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/scene/session_scene.hpp"
#include "tools/studies/plan/plan.hpp"

namespace merkel {
namespace {

const std::vector<std::string>& job_columns() {
  static const std::vector<std::string> columns = {"scene", "probe", "seed", "duration_s", "name"};
  return columns;
}

/// A hash of a file's content, which is read once while it does not change; empty without a file.
std::string hash_of_file(const std::string& path) {
  struct Known {
    std::filesystem::file_time_type time;
    std::uintmax_t size = 0;
    std::string hash;
  };
  static std::map<std::string, Known> known;
  std::error_code ignored;
  // The run of a file that cannot be read says so.
  if (!std::filesystem::is_regular_file(path, ignored)) return {};
  ReadFiles::note(path);
  const auto time = std::filesystem::last_write_time(path, ignored);
  const std::uintmax_t size = std::filesystem::file_size(path, ignored);
  Known& of_file = known[path];
  if (of_file.hash.empty() || of_file.time != time || of_file.size != size) {
    SpikeHash hash;
    std::ifstream file(path, std::ios::binary);
    std::string piece(std::size_t{1} << 20U, '\0');
    while (file.good()) {
      file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
      hash.add(piece.substr(0, static_cast<std::size_t>(file.gcount())));
    }
    of_file = {time, size, hash.text()};
  }
  return of_file.hash;
}

/// The URI of a probe; of a recording with its whole path and a hash of its content.
std::string content_of(const std::string& probe) {
  constexpr std::string_view kReplay = "replay:";
  if (!probe.starts_with(kReplay)) return probe;
  const std::size_t end = std::min(probe.find('?'), probe.size());
  const std::string path =
      path_or_example(Example::kTrace, probe.substr(kReplay.size(), end - kReplay.size()));
  std::error_code ignored;
  return std::filesystem::absolute(path, ignored).string() + probe.substr(end) + "#" +
         hash_of_file(path);
}

/// The name of a preset, or the text of a scene file, read once.
class SceneTexts {
 public:
  const std::string& operator()(const std::string& name_or_file) {
    const auto [at, added] = known_.try_emplace(name_or_file, name_or_file);
    if (added && !preset_scene(name_or_file)) {
      if (const auto scene = scene_named(name_or_file)) at->second = scene_text(*scene);
    }
    return at->second;
  }

 private:
  std::map<std::string, std::string> known_;
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
    if (!number || !(*number >= 0.0 && *number < 9e15) || *number != std::floor(*number)) {
      job.error = "seed must be a whole number from 0 on, but is " + cell;
    } else {
      job.seed = static_cast<std::uint64_t>(*number);
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

/// A word of a command, in quotes where the shell needs them.
std::string shell_word(const std::string& text) {
  const bool plain = !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 ||
           std::string_view("_-./:=,+").find(static_cast<char>(c)) != std::string_view::npos;
  });
  if (plain) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

Json failure(const std::string& sentence) { return {{"status", "failed"}, {"error", sentence}}; }

Expected<PreparedRun, SetupError> prepare(const BatchJob& job, ModelCache& models) {
  auto base = scene_named(job.scene);
  if (!base) return Unexpected<SetupError>(base.error());
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

double rounded(double value) { return std::round(value * 1e6) / 1e6; }

}  // namespace

std::string batch_id(const BatchJob& job, const std::string& scene, const std::string& kept,
                     const std::string& more) {
  SpikeHash hash;
  const auto all = {std::string(MERKEL_VERSION),
                    std::string(kGitHash),
                    scene,
                    content_of(job.probe),
                    job.seed ? std::to_string(*job.seed) : std::string(),
                    job.duration_s ? shortest_decimal(*job.duration_s) : std::string(),
                    kept,
                    kept.empty() ? std::string() : job.name,
                    more};
  for (const std::string& each : all) hash.add(each);
  for (const auto& [name, value] : job.overrides) {
    hash.add(name);
    hash.add(value);
  }
  return hash.text();
}

Expected<std::string, SetupError> kept_file(const BatchJob& job, const std::string& extension) {
  constexpr std::size_t kMaxBytes = 200;
  const std::string& name = job.name;
  const bool fits = name.size() <= kMaxBytes && !name.starts_with('.') &&
                    name.find_first_of("/?#&%|\\\"") == std::string::npos &&
                    std::none_of(name.begin(), name.end(),
                                 [](char c) { return static_cast<unsigned char>(c) < 0x20; });
  const std::string file = (name.empty() ? job.id : name) + "." + extension;
  if (fits && file != BatchKeep::kTable) return file;
  return bad_input("the name \"" + name +
                   "\" of a job cannot be that of its kept file: use at most 200 letters, digits, "
                   "blanks, - and _, no dot at its start, and not results");
}

std::string command_of(const BatchJob& job) {
  std::string text = "merkel run " + shell_word(job.scene) + " --fast";
  const auto add = [&text](const std::string& option, const std::string& value) {
    text += " " + option + " " + shell_word(value);
  };
  if (!job.probe.empty()) add("--probe", job.probe);
  if (job.seed) add("--seed", std::to_string(*job.seed));
  if (job.duration_s) add("--duration-s", shortest_decimal(*job.duration_s));
  for (const auto& [name, value] : job.overrides) add("--set", name + "=" + value);
  return text;
}

Expected<BatchKeep, SetupError> keep_in(const std::string& folder, const std::string& format) {
  const std::vector<std::pair<std::string, std::string>> known = {{"table", ""},    {"nwb", "nwb"},
                                                                  {"xdf", "xdf"},   {"csv", "csv"},
                                                                  {"sonata", "h5"}, {"gdf", "gdf"}};
  std::string list;
  for (const auto& [name, extension] : known) {
    if (name == format) return BatchKeep{folder, extension.empty() ? "" : name, extension};
    list.append(list.empty() ? "" : ", ").append(name);
  }
  return bad_input("--keep " + format + " is not one of " + list);
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
    const std::string nearest = nearest_name(column, known);
    return bad_input("the jobs have a column \"" + column + "\"" +
                     (nearest.empty() ? ": the columns are scene, probe, seed, duration_s, name "
                                        "and keys of scenes such as skin.radius_mm"
                                      : ": did you mean " + nearest + "?"));
  }
  std::vector<BatchJob> jobs;
  std::map<std::string, std::string> names;  // of kept files, with the job of each
  SceneTexts texts;
  for (const auto& row : table.rows) {
    BatchJob job{.scene = "paper"};
    for (std::size_t i = 0; i < row.size(); ++i) set_cell(table.columns[i], row[i], job);
    job.id = batch_id(job, texts(job.scene), keep.format);
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

const std::vector<std::string>& outcome_columns() {
  static const std::vector<std::string> columns = {
      "status",  "error",   "spikes",     "firing", "rate_hz", "busiest_hz", "simulated_s",
      "verdict", "version", "spike_hash", "file",   "run_s",   "command"};
  return columns;
}

Json run_batch_job(const BatchJob& job, const BatchKeep& keep, ModelCache& models) {
  const auto begin = std::chrono::steady_clock::now();
  if (!job.error.empty()) return failure(job.error);
  auto run = prepare(job, models);
  if (!run) return failure(run.error().sentence);
  const TactileModel& model = *run->model;
  Pipeline pipeline(*run->model, run->parameters);
  run->add_probes_to(pipeline);
  const SinkSetup setup{.neurons = static_cast<std::uint32_t>(model.neurons()),
                        .overwrite = true,
                        .run = std::move(run->description)};
  std::vector<std::string> sinks = run->scene.sinks;
  if (!job.file.empty()) sinks.push_back(keep.format + ":" + keep.folder + "/" + job.file);
  auto opened = open_sinks(sinks, setup);
  if (!opened) return failure(opened.error().sentence);
  for (auto& sink : *opened) pipeline.add_sink(std::move(sink));
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
  if (!report) return failure(report.error().sentence);
  if (!report->error_message.empty()) return failure(report->error_message);
  for (const RunReport::OfSink& sink : report->sinks) {
    if (!sink.error_message.empty()) return failure(sink.error_message);
  }
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
