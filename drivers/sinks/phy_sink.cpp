#include "drivers/sinks/phy_sink.hpp"

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/files/file_rename.hpp"
#include "drivers/files/output_file.hpp"

namespace merkel {
namespace {

constexpr std::uint64_t kBuffered = 65536;  ///< spikes buffered for a flush

std::int64_t sample_of(std::chrono::nanoseconds time, double sample_rate_hz) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(time);
  // Whole seconds are converted separately, so that large times keep all digits.
  return static_cast<std::int64_t>(sample_rate_hz) * whole.count() +
         std::llround(units::s_from(time - whole) * sample_rate_hz);
}

Expected<void, SetupError> write_file(const std::string& path, const std::string& content,
                                      bool overwrite) {
  auto file = OutputFile::create(path, overwrite);
  if (!file) return Unexpected<SetupError>(file.error());
  if (!file->write(content) || !file->close()) return unavailable(file->error());
  return {};
}

}  // namespace

PhySink::PhySink(const Uri& uri, const SinkSetup& setup, double sample_rate_hz, TimeBase time,
                 Folder folder)
    : uri_(uri.text),
      folder_(std::move(folder)),
      overwrite_(setup.overwrite),
      sample_rate_hz_(sample_rate_hz),
      time_(time),
      afferents_(afferents_of(setup)) {}

Expected<PhySink::Folder, SetupError> PhySink::lock_folder(const std::string& path,
                                                           const SinkSetup& setup) {
  Folder folder{.path = path, .lock = -1, .made = ::mkdir(path.c_str(), 0777) == 0};
  if (!folder.made && errno != EEXIST) {
    return bad_input("cannot make the folder " + path + ": " + std::strerror(errno) +
                     (errno == ENOENT ? "; create its parent first" : ""));
  }
  folder.lock = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder.lock < 0) return bad_input("cannot open " + path + ": " + std::strerror(errno));
  if (::flock(folder.lock, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    ::close(folder.lock);
    return bad_input("cannot write " + path +
                     ": another sink or merkel process is writing it; give another name");
  }
  if (folder.made || setup.overwrite) return folder;
  const std::string times = path + "/spike_times.npy";
  if (!file_exists(times + ".part") || file_exists(times)) {
    ::close(folder.lock);
    return bad_input(path + " already exists: add --overwrite, or give another name");
  }
  // Left by a killed run.
  struct stat status {};
  static_cast<void>(::stat((times + ".part").c_str(), &status));
  const std::string kept =
      recovered_name(path, std::chrono::system_clock::from_time_t(status.st_mtim.tv_sec));
  const int error = rename_without_replacing(path, kept);
  ::close(folder.lock);
  if (error != 0) return bad_input("cannot rename " + path + ": " + std::strerror(error));
  if (setup.notice) {
    setup.notice("a killed run left " + path + "; it was renamed to " + kept);
  }
  return lock_folder(path, setup);
}

Expected<std::unique_ptr<Sink>, SetupError> PhySink::open(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const auto rate_hz =
      static_cast<double>(options.whole("sample_rate", 1'000'000, 1000, 1'000'000'000));
  const TimeBase time = TimeBase::read(options, setup);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (uri.path.empty()) {
    return bad_input("\"" + uri.text + "\": give the folder to write: phy:DIR");
  }
  auto folder = lock_folder(uri.path, setup);
  if (!folder) return Unexpected<SetupError>(folder.error());
  std::unique_ptr<PhySink> sink(new PhySink(uri, setup, rate_hz, time, std::move(*folder)));
  if (auto opened = sink->open_files(); !opened) return Unexpected<SetupError>(opened.error());
  return sink;
}

Expected<void, SetupError> PhySink::open_files() {
  for (const auto& [name, type] :
       {std::pair("spike_times.npy", "<i8"), std::pair("spike_clusters.npy", "<i4"),
        std::pair("spike_templates.npy", "<i4")}) {
    auto file = NpyFile::create(in_folder(name), type, overwrite_);
    if (!file) return Unexpected<SetupError>(file.error());
    files_.push_back(std::move(*file));
  }
  return {};
}

PhySink::~PhySink() {
  files_.clear();  // files without spikes are removed
  if (!started_ && !closed_ && folder_.made) ::rmdir(folder_.path.c_str());
  ::close(folder_.lock);
}

Expected<void, SetupError> PhySink::write_parameters() {
  std::string text = "# Spikes simulated by merkel; there is no raw recording.\n";
  for (const auto& [name, value] : time_.facts()) {
    text += name + " = " + (name == "time_zero" ? "'" + value + "'" : value) + "\n";
  }
  text += "dat_path = []\nn_channels_dat = " +
          std::to_string(std::max<std::size_t>(1, afferents_.size())) +
          "\ndtype = 'int16'\noffset = 0\nsample_rate = " + shortest_decimal(sample_rate_hz_) +
          "\nhp_filtered = True\n";
  return write_file(in_folder("params.py"), text, overwrite_);
}

Expected<void, SetupError> PhySink::write_channels() {
  if (afferents_.empty()) return {};
  auto map = NpyFile::create(in_folder("channel_map.npy"), "<i4", overwrite_);
  if (!map) return Unexpected<SetupError>(map.error());
  auto positions = NpyFile::create(in_folder("channel_positions.npy"), "<f8", overwrite_, 2);
  if (!positions) return Unexpected<SetupError>(positions.error());
  for (const AfferentRow& row : afferents_) {
    map->append(std::int64_t{row.number} - 1);
    positions->append(1e3 * row.x_mm);
    positions->append(1e3 * row.y_mm);
  }
  if (!map->close()) return unavailable(map->error());
  if (!positions->close()) return unavailable(positions->error());
  return write_file(in_folder("afferents.csv"), afferent_csv(afferents_), overwrite_);
}

template <class Action>
Expected<void, SinkError> PhySink::for_all(Action action) {
  for (NpyFile& file : files_) {
    if (!action(file)) return Unexpected<SinkError>({.sentence = file.error()});
  }
  delivered_ = taken_;
  return {};
}

Expected<void, SinkError> PhySink::begin(const RunOrigin& origin) {
  if (std::exchange(started_, true)) return {};
  time_.set(origin);
  for (const auto& written : {write_parameters(), write_channels()}) {
    if (!written) return Unexpected<SinkError>({.sentence = written.error().sentence});
  }
  return {};
}

Expected<void, SinkError> PhySink::write(const RecordBatch& batch) {
  if (auto started = begin({}); !started) return started;
  for (const SpikeEvent& spike : batch.spikes) {
    const std::int64_t neuron = spike.neuron;
    files_[kTimes].append(sample_of(time_(spike.time), sample_rate_hz_));
    files_[kClusters].append(neuron);
    files_[kTemplates].append(neuron);
  }
  taken_ += batch.spikes.size();
  if (taken_ - delivered_ < kBuffered) return {};
  return flush();
}

Expected<void, SinkError> PhySink::flush() {
  return for_all([](NpyFile& file) { return file.flush(); });
}

Expected<void, SinkError> PhySink::close() {
  if (auto started = begin({}); !started) return started;
  closed_ = true;
  return for_all([](NpyFile& file) { return file.close(); });
}

}  // namespace merkel
