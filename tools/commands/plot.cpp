#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/os.h>

#include "core/scene/patch_layout.hpp"
#include "core/units.hpp"
#include "drivers/files/example_file.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/sessions/session_samples.hpp"
#include "drivers/spike_files/spike_file.hpp"
#include "tools/commands/command.hpp"
#include "tools/run/recorded_session.hpp"
#include "tools/scratch_folder.hpp"
#include "tools/studies/report/plot_runner.hpp"

namespace merkel {
namespace {

struct PlotOptions {
  std::vector<std::string> files;
  std::string out;
  bool overwrite = false;
};

constexpr std::size_t kMaxPressRows = 100'000;

/// A table of what the probes measured. Beyond kMaxPressRows, every second row is left out, then
/// every fourth, and so on: the picture has fewer pixels.
class PressTable {
 public:
  void add(double time_s, std::size_t probe, const ContactInput& input) {
    if (counts_.size() <= probe) counts_.resize(probe + 1);
    if (counts_[probe]++ % step_ != 0) return;
    rows_.push_back({time_s, probe, input});
    if (rows_.size() < kMaxPressRows) return;
    step_ *= 2;
    std::vector<std::size_t> seen(counts_.size());
    std::erase_if(rows_, [&](const Row& row) { return seen[row.probe]++ % 2 != 0; });
  }
  void add(double time_s, std::size_t probe, const ProbeSample& sample) {
    add(time_s, probe, {sample.depth_mm, sample.force_mN, sample.x_mm, sample.y_mm});
  }
  [[nodiscard]] bool empty() const noexcept { return rows_.empty(); }
  void write(const std::string& path) const {
    auto file = fmt::output_file(path);
    file.print("time_s,probe,depth_mm,force_N,x_mm,y_mm\n");
    for (const auto& [time_s, probe, input] : rows_) {
      file.print("{},{},{},{},{},{}\n", time_s, probe, input.depth_mm, input.force_mN / 1000.0,
                 input.x_mm, input.y_mm);
    }
  }

 private:
  struct Row {
    double time_s;
    std::size_t probe;
    ContactInput input;
  };
  std::vector<Row> rows_;
  std::vector<std::size_t> counts_;
  std::size_t step_ = 1;
};

void write_afferents(const Scene& scene, const std::string& path) {
  auto file = fmt::output_file(path);
  file.print("neuron,x_mm,y_mm,patch\n");
  std::size_t number = 0;
  for (std::size_t i = 0; i < scene.model.patches.size(); ++i) {
    const PatchParameters& patch = scene.model.patches[i];
    const auto layout = layout_of(patch);
    if (!layout) return;
    for (const AfferentSite& site : layout->afferents) {
      file.print("{},{},{},{}\n", ++number, site.x_mm, site.y_mm,
                 patch.name.empty() ? "patch " + std::to_string(i) : patch.name);
    }
  }
}

/// Where the press of a tick is on the skin: of a surface that slides, the tick has the place on
/// the surface. Of a tactile array, its taxels know.
ContactInput on_skin(const TickRecord& tick, const std::optional<Scene>& scene) {
  ContactInput contact = tick.contact;
  if (!scene || tick.probe >= scene->model.indenters.size()) return contact;
  const Indenter& indenter = scene->model.indenters[tick.probe];
  if (indenter.surface.slides) {
    contact.x_mm = scene->model.skin.apex->x_mm;
    contact.y_mm = scene->model.skin.apex->y_mm;
  } else if (indenter.taxels() != nullptr) {
    contact.x_mm = contact.y_mm = std::numeric_limits<double>::quiet_NaN();
  }
  return contact;
}

Expected<void, SetupError> tables_of_session(const std::string& path, const ScratchFolder& folder) {
  const auto session = RecordedSession::open(path);
  if (!session) return Unexpected<SetupError>(session.error());
  const auto seconds = [origin = (*session)->origin().start](std::chrono::nanoseconds time) {
    return units::s_from(time - origin);
  };
  PressTable press;
  PressTable samples;  // drawn of a session without ticks
  auto spikes = fmt::output_file(folder.file("spikes.csv"));
  auto commands = fmt::output_file(folder.file("commands.csv"));
  spikes.print("time_s,neuron\n");
  commands.print("time_s,electrode,amplitude_uA,frequency_Hz\n");
  const auto read = (*session)->read([&](const RecordBatch& batch) {
    for (const TickRecord& tick : batch.ticks) {
      press.add(seconds(tick.time), tick.probe, on_skin(tick, (*session)->scene()));
    }
    for (const DeliveredSample& each : batch.samples) {
      samples.add(seconds(each.sample.time), each.probe, each.sample);
    }
    for (const SpikeEvent& spike : batch.spikes) {
      spikes.print("{},{}\n", seconds(spike.time), spike.neuron);
    }
    for (const StimulationCommand& each : batch.commands) {
      commands.print("{},{},{},{}\n", seconds(each.time), each.electrode, each.amplitude_uA,
                     each.frequency_Hz);
    }
    return true;
  });
  if (!read) return bad_input(read.error());
  (press.empty() ? samples : press).write(folder.file("press.csv"));
  if ((*session)->scene()) write_afferents(*(*session)->scene(), folder.file("afferents.csv"));
  return {};
}

Expected<void, SetupError> table_of_trace(const std::string& path, const ScratchFolder& folder) {
  auto probe = open_probe("replay:" + path);
  if (!probe) return Unexpected<SetupError>(probe.error());
  Readings readings = (*probe)->readings();
  PressTable press;
  for (;;) {
    const auto read = (*probe)->read(readings, std::chrono::milliseconds{0});
    if (!read && read.error() == ProbeError::kEndOfStream) break;
    if (!read) return bad_input((*probe)->error_message());
    for (std::size_t i = 0; i < *read; ++i) {
      if (const auto sample = readings.sample(i)) {
        press.add(units::s_from(sample->time), 0, *sample);
      }
    }
  }
  press.write(folder.file("press.csv"));
  return {};
}

Expected<void, SetupError> table_of_spikes(const std::string& path, const ScratchFolder& folder) {
  const auto file = read_spike_file(path);
  if (!file) return Unexpected<SetupError>(file.error());
  auto spikes = fmt::output_file(folder.file("spikes.csv"));
  spikes.print("time_s,neuron\n");
  for (const RecordedSpike& spike : file->spikes) {
    spikes.print("{},{}\n", units::s_from(spike.time), spike.neuron);
  }
  return {};
}

/// A session, a trace or a file of spikes, by what can be read.
Expected<void, SetupError> tables_of(const std::string& given, const ScratchFolder& folder) {
  const std::string path = path_or_example(Example::kTrace, given);
  if (SessionSamples::is_session(path)) return tables_of_session(path, folder);
  if (table_of_spikes(path, folder)) return {};
  if (auto trace = table_of_trace(path, folder); !trace) {
    return bad_input(
        path + " cannot be read as a session, as spikes or as a trace: " + trace.error().sentence);
  }
  return {};
}

Expected<void, SetupError> plot(const PlotOptions& options) {
  const std::string extension = std::filesystem::path(options.out).extension();
  if (!options.out.empty() && extension != ".png" && extension != ".svg" && extension != ".pdf") {
    return bad_input("--out " + options.out + ": a picture ends in .png, .svg or .pdf");
  }
  if (!options.out.empty()) {
    if (auto free = check_writable(options.out, options.overwrite); !free) return free;
  }
  if (!python_has("matplotlib")) {
    return unavailable("merkel plot draws with matplotlib: install python3-matplotlib");
  }
  const ScratchFolder picture("plot");
  if (!picture.made()) return unavailable("cannot make a temporary folder for the tables");
  const std::string drawn = options.out.empty() ? "" : picture.file("picture" + extension);
  std::vector<std::string> arguments = {drawn};
  std::vector<std::unique_ptr<ScratchFolder>> folders;
  for (const std::string& file : options.files) {
    folders.push_back(std::make_unique<ScratchFolder>("plot"));
    if (!folders.back()->made())
      return unavailable("cannot make a temporary folder for the tables");
    if (auto tables = tables_of(file, *folders.back()); !tables) return tables;
    arguments.push_back(folders.back()->file(""));
    arguments.push_back(file);
  }
  if (auto script = run_script("plot", arguments); !script || drawn.empty()) return script;
  constexpr std::size_t kMaxBytes = std::size_t{1} << 30U;
  const auto bytes = read_whole_file(drawn, "picture", kMaxBytes);
  if (!bytes) return Unexpected<SetupError>(bytes.error());
  auto out = OutputFile::create(options.out, options.overwrite);
  if (!out) return Unexpected<SetupError>(out.error());
  if (!out->write(*bytes) || !out->close()) return unavailable(out->error());
  return {};
}

}  // namespace

void add_plot_command(CommandLine& program) {
  auto options = std::make_shared<PlotOptions>();
  program
      .subcommand(
          "plot",
          "Draws sessions, traces or files of spikes, side by side: depth and force, a raster of the "
          "busiest afferents, their rates on the skin, stimulation commands. Needs "
          "matplotlib (python3-matplotlib).",
          "plot session.xdf --out session.png")
      .list("files", options->files, "Sessions (xdf), traces (csv) or files of spikes")
      .required()
      .option("--out", options->out, "Picture to write: .png, .svg or .pdf; default: a window")
      .flag("--overwrite", options->overwrite, "Replace an existing picture")
      .runs([options] {
        const auto done = plot(*options);
        return done ? kDone : refuse(done.error());
      });
}

}  // namespace merkel
