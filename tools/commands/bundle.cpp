#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/core.h>

#include "drivers/files/height_map_file.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/sessions/rig_recording.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "tools/child_process.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/export_run.hpp"
#include "tools/print_text.hpp"
#include "tools/run/recorded_session.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

namespace fs = std::filesystem;

struct BundleOptions {
  std::string session;
  std::string folder;
  std::string facts;
  double trials = 50;
  bool skip_score = false;
};

/// The folder and what was put into it.
class Bundle {
 public:
  explicit Bundle(std::string folder) : folder_(std::move(folder)) {}

  [[nodiscard]] std::string path(const std::string& name) const { return folder_ + "/" + name; }
  /// Lists a file in the README.
  void list(const std::string& name, const std::string& content) {
    files_ += fmt::format("| `{}` | {} |\n", name, content);
  }
  Expected<void, SetupError> write(const std::string& name, const std::string& text,
                                   const std::string& content) {
    auto file = OutputFile::create(path(name), false);
    if (!file) return Unexpected<SetupError>(file.error());
    if (!file->write(text) || !file->close()) return unavailable(file->error());
    if (!content.empty()) list(name, content);
    return {};
  }
  [[nodiscard]] const std::string& files() const noexcept { return files_; }

 private:
  std::string folder_;
  std::string files_;
};

Expected<void, SetupError> make_folder(const std::string& folder) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_empty(folder, error)) {
    return bad_input(folder + " exists and is not empty: name a new folder with --out");
  }
  fs::create_directories(folder, error);
  if (error) return unavailable("cannot make the folder " + folder + ": " + error.message());
  return {};
}

/// The scene of the run, complete, beside its measured shapes. The session has the text of the
/// scene as it was given, without the seeds of the command line.
Expected<void, SetupError> write_scene(Bundle& bundle) {
  auto scene = scene_named(bundle.path("session.xdf"));
  if (!scene) return Unexpected<SetupError>(scene.error());
  auto& indenters = scene->model.indenters;
  for (std::size_t i = 0; i < indenters.size(); ++i) {
    auto* const shape = std::get_if<ShapeTip>(&indenters[i].tip);
    if (shape == nullptr) continue;
    shape->file = fmt::format("shape_{}.csv", i + 1);
    auto written = bundle.write(shape->file, csv_heights(*shape->map),
                                fmt::format("the heights of the tip of probe {}, mm", i + 1));
    if (!written) return written;
  }
  return bundle.write("scene.toml", scene_text(*scene),
                      "the scene: every parameter of skin, tip and afferents, and the seeds");
}

/// The scene, the calibrations and the versions.
Expected<void, SetupError> write_facts(const RecordedSession& session, Bundle& bundle) {
  const auto reader = session.reader();
  if (!reader) return Unexpected<SetupError>(reader.error());
  auto written = write_scene(bundle);
  const auto calibrations = reader->facts("probe_calibration");
  for (std::size_t i = 0; written && i < calibrations.size(); ++i) {
    if (calibrations[i].empty()) continue;
    written = bundle.write(fmt::format("calibration_{}.toml", i + 1), calibrations[i],
                           fmt::format("the calibration of probe {}", i + 1));
  }
  if (!written) return written;
  std::string versions;
  for (const auto& [name, value] : reader->facts()) {
    const bool text = value.find('\n') != std::string::npos || value.empty();
    if (!text) versions += name + " = " + value + "\n";
  }
  versions += "bundled_by = merkel " MERKEL_VERSION "\n";
  return bundle.write("versions.txt", versions,
                      "the versions of merkel, of the kernel and of the machine, the seeds, and "
                      "where the run began");
}

std::string readme(const RecordedSession& session, const Bundle& bundle, std::uint64_t spikes) {
  return fmt::format(
      "# A run of merkel: {}\n\n{} spikes of {} simulated SAI afferents.\n\n| file | content "
      "|\n|---|---|\n{}| `SHA256SUMS` | checksums: `sha256sum --check SHA256SUMS` |\n\nThe spikes "
      "follow from the session alone, to the bit:\n\n```sh\nmerkel replay session.xdf\n```\n\nmerkel "
      "{} made this folder.\n",
      session.run().scene, spikes, session.neurons(), bundle.files(), MERKEL_VERSION);
}

bool list_checksums(const std::string& folder) {
  return ChildProcess({"sh", "-c",
                       "cd \"$0\" && find . -type f ! -name SHA256SUMS -printf '%P\\0' | LC_ALL=C "
                       "sort -z | xargs -0 sha256sum >SHA256SUMS",
                       folder})
             .wait() == 0;
}

int bundle_session(const BundleOptions& options) {
  auto opened = RecordedSession::open(options.session);
  if (!opened) return refuse(opened.error());
  const std::shared_ptr<RecordedSession> session = std::move(*opened);
  if (!session->scene() || !split_rig(options.session).second.empty()) {
    return refuse(options.session +
                  " has no ticks to replay: only a session of merkel run can be bundled");
  }
  if (auto made = make_folder(options.folder); !made) return refuse(made.error());
  Bundle bundle(options.folder);
  std::error_code error;
  fs::copy_file(options.session, bundle.path("session.xdf"), error);
  if (error) return fail("cannot copy " + options.session + ": " + error.message());
  const int replayed = ChildProcess({own_program(), "replay", bundle.path("session.xdf")}).wait();
  if (replayed != kDone) {
    return fail("the replay of " + options.session +
                (replayed == kFailed ? " is not bit-identical" : " does not run") +
                ", so the bundle would not prove itself: merkel replay " + options.session +
                " says why");
  }
  bundle.list(
      "session.xdf",
      "the whole run (XDF): inputs of every tick, spikes, commands, samples, events, marks");
  std::uint64_t spikes = 0;
  const std::string nwb =
      "nwb:" + bundle.path("session.nwb") + (options.facts.empty() ? "" : "?" + options.facts);
  const std::vector<std::string> sinks = {nwb, "csv:" + bundle.path("spikes.csv")};
  const int exit_code = export_run(session, session->origin(), sinks,
                                   {.neurons = session->neurons(), .run = session->run()}, spikes);
  if (exit_code != kDone) return exit_code;
  bundle.list("session.nwb",
              "spikes, stimulus, commands and intervals (Neurodata Without Borders)");
  bundle.list("spikes.csv", "the spikes: time in s, neuron");
  if (auto written = write_facts(*session, bundle); !written) return refuse(written.error());
  if (!options.skip_score) {
    const ChildProcess::Output quiet = ChildProcess::Output::kNone;
    if (ChildProcess(
            {own_program(), "score", bundle.path("scene.toml"), "--out", bundle.path("score"),
             "--trials", fmt::format("{:.0f}", options.trials), "--skip-experiments"},
            quiet)
            .wait() != 0) {
      return fail("the scene cannot be scored: merkel score " + bundle.path("scene.toml") +
                  " says why; or leave the score out with --skip-score");
    }
    bundle.list("score/", "how far the scene's rates are from published recordings");
  }
  const auto written = bundle.write("README.md", readme(*session, bundle, spikes), "");
  if (!written) return refuse(written.error());
  if (!list_checksums(options.folder)) return fail("sha256sum of coreutils did not run");
  print_text(stderr, "{}: {} spikes, bit-identical in a replay\n", options.folder, spikes);
  return kDone;
}

}  // namespace

void add_bundle_command(CommandLine& program) {
  auto options = std::make_shared<BundleOptions>();
  program
      .subcommand("bundle",
                  "Makes the folder that a data archive wants of a run: the session, NWB, the "
                  "scene, the calibrations, the versions, the score of the scene, a README and "
                  "checksums. Checks that a replay is bit-identical.",
                  "bundle session.xdf --out deposit --facts "
                  "'subject_id=model-1&species=Homo sapiens&sex=U&age=P30Y'")
      .option("session", options->session, "Session, as recorded by --sink xdf:FILE")
      .required()
      .option("--out", options->folder, "New folder")
      .required()
      .option("--facts", options->facts,
              "Facts of the experiment for NWB, as options of the sink nwb:, separated by &")
      .option("--trials", options->trials, "Repetitions of each press of the score", {1, 10000})
      .flag("--skip-score", options->skip_score, "Leave out the score, which takes minutes")
      .runs([options] { return bundle_session(*options); });
}

}  // namespace merkel
