#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <system_error>
#include <tuple>
#include <utility>

#include <sys/stat.h>
#include <unistd.h>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/files/npy_file.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/sessions/afferent_table.hpp"
#include "drivers/sinks/export_sink.hpp"
#include "drivers/sinks/time_base.hpp"

namespace merkel {
namespace {

using Written = Expected<void, std::string>;

constexpr std::size_t kFlushEvery = 65536;  ///< spikes
constexpr const char* kTimes = "spike_times.npy";

std::int64_t sample_of(std::chrono::nanoseconds time, double sample_rate_hz) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(time);
  // Whole seconds are converted separately, so that large times keep all digits.
  return static_cast<std::int64_t>(sample_rate_hz) * whole.count() +
         std::llround(units::s_from(time - whole) * sample_rate_hz);
}

/// A folder for Phy and Neo: `spike_times.npy` (in samples of 1 µs, or of the option sample_rate),
/// `spike_clusters.npy` and `spike_templates.npy` (neurons from 1), `channel_map.npy` and
/// `channel_positions.npy` (one entry per afferent, µm), `afferents.csv` and `params.py`.
struct PhyFolder {
  std::string path;
  bool overwrite;
  double sample_rate_hz;
  TimeBase time;
  std::vector<AfferentRow> afferents;

  [[nodiscard]] std::string file(const char* name) const { return path + "/" + name; }
  [[nodiscard]] Written write_text(const char* name, const std::string& content) const;
  [[nodiscard]] Written write_parameters() const;
  [[nodiscard]] Written write_channels() const;
  [[nodiscard]] Written write_spikes(RunJournal& journal) const;
};

/// Fills NumPy files and closes them.
template <class Fill>
Written write_arrays(
    const PhyFolder& folder,
    std::initializer_list<std::tuple<const char*, const char*, std::size_t>> arrays,
    const Fill& fill) {
  std::vector<NpyFile> files;
  for (const auto& [name, type, columns] : arrays) {
    auto file = NpyFile::create(folder.file(name), type, folder.overwrite, columns);
    if (!file) return Unexpected<std::string>(file.error().sentence);
    files.push_back(std::move(*file));
  }
  const Written filled = fill(files);
  for (NpyFile& file : files) {
    if (filled && !file.close()) return Unexpected<std::string>(file.error());
  }
  return filled;
}

Written PhyFolder::write_text(const char* name, const std::string& content) const {
  auto output = OutputFile::create(file(name), overwrite);
  if (!output) return Unexpected<std::string>(output.error().sentence);
  if (!output->write(content) || !output->close()) return Unexpected<std::string>(output->error());
  return {};
}

Written PhyFolder::write_parameters() const {
  std::string text = "# Spikes simulated by merkel; there is no raw recording.\n";
  for (const auto& [name, value] : time.facts()) {
    text += name + " = " + (name == "time_zero" ? "'" + value + "'" : value) + "\n";
  }
  text += "dat_path = []\nn_channels_dat = " +
          std::to_string(std::max<std::size_t>(1, afferents.size())) +
          "\ndtype = 'int16'\noffset = 0\nsample_rate = " + shortest_decimal(sample_rate_hz) +
          "\nhp_filtered = True\n";
  return write_text("params.py", text);
}

Written PhyFolder::write_channels() const {
  if (afferents.empty()) return {};
  const Written written =
      write_arrays(*this, {{"channel_map.npy", "<i4", 0}, {"channel_positions.npy", "<f8", 2}},
                   [this](std::vector<NpyFile>& files) {
                     for (const AfferentRow& row : afferents) {
                       files[0].append(std::int64_t{row.number} - 1);
                       files[1].append(1e3 * row.x_mm);
                       files[1].append(1e3 * row.y_mm);
                     }
                     return Written();
                   });
  return written ? write_text("afferents.csv", afferent_csv(afferents)) : written;
}

Written PhyFolder::write_spikes(RunJournal& journal) const {
  return write_arrays(
      *this,
      {{"spike_clusters.npy", "<i4", 0}, {"spike_templates.npy", "<i4", 0}, {kTimes, "<i8", 0}},
      [&](std::vector<NpyFile>& files) {
        std::string error;
        std::size_t waiting = 0;
        Written read = journal.read([&](const RecordBatch& batch) {
          for (const SpikeEvent& spike : batch.spikes) {
            files[0].append(std::int64_t{spike.neuron});
            files[1].append(std::int64_t{spike.neuron});
            files[2].append(sample_of(time(spike.time), sample_rate_hz));
          }
          waiting += batch.spikes.size();
          if (waiting < kFlushEvery) return true;
          waiting = 0;
          for (NpyFile& file : files) {
            if (error.empty() && !file.flush()) error = file.error();
          }
          return error.empty();
        });
        return error.empty() ? std::move(read) : Written(Unexpected<std::string>(error));
      });
}

Written write_phy(const PhyFolder& folder, RunJournal& journal) {
  const bool made = ::mkdir(folder.path.c_str(), 0777) == 0;
  if (!made && !(errno == EEXIST && folder.overwrite)) {
    return Unexpected<std::string>("cannot make the folder " + folder.path + ": " +
                                   std::strerror(errno));
  }
  // The times come last: a folder with them is complete, and of one run.
  if (!made) ::unlink(folder.file(kTimes).c_str());
  Written written = folder.write_parameters();
  if (written) written = folder.write_channels();
  if (written) written = folder.write_spikes(journal);
  std::error_code ignored;
  if (written || !made) return written;
  std::filesystem::remove_all(folder.path, ignored);
  // What the sentence says was kept is gone with the folder.
  std::string error = written.error();
  error.resize(std::min(error.find(OutputFile::kEarlierDataIn), error.size()));
  return Unexpected<std::string>(std::move(error));
}

}  // namespace

OpenedSink open_phy_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  PhyFolder folder{.path = uri.path,
                   .overwrite = setup.overwrite,
                   .sample_rate_hz = static_cast<double>(
                       options.whole("sample_rate", 1'000'000, 1000, 1'000'000'000)),
                   .time = TimeBase::read(options, setup),
                   .afferents = afferents_of(setup)};
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  while (folder.path.size() > 1 && folder.path.ends_with('/')) folder.path.pop_back();
  if (uri.path.empty()) {
    return bad_input("\"" + uri.text + "\": give the folder to write: phy:DIR");
  }
  Uri own = uri;  // the journal is beside the folder
  own.path = folder.path;
  return ExportSink::open(own, setup, folder.time,
                          [folder = folder](RunJournal& journal, const TimeBase& time) mutable {
                            folder.time = time;
                            return write_phy(folder, journal);
                          });
}

}  // namespace merkel
