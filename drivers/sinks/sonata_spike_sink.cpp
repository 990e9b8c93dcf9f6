#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <utility>
#include <vector>

#include <hdf5.h>
#include <sys/stat.h>

#include "core/units.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/sinks/sink_openers.hpp"

namespace merkel {
namespace {

constexpr std::size_t kBuffered = 65536;  ///< spikes that wait for a flush
constexpr hsize_t kChunk = 16384;         ///< spikes a chunk of the file
constexpr std::uint32_t kMagic = 0x0A7A;  ///< of every SONATA file

/// The library keeps state of its own and is not built for several threads: one sink at a time.
std::mutex& hdf5_mutex() {
  static std::mutex mutex;
  return mutex;
}

/// An HDF5 handle, closed by the function of its kind.
class Handle {
 public:
  Handle(hid_t id, herr_t (*closer)(hid_t)) : id_(id), close_(closer) {}
  Handle(Handle&& other) noexcept
      : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Handle& operator=(Handle&&) = delete;
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() { static_cast<void>(close()); }
  [[nodiscard]] hid_t id() const { return id_; }
  [[nodiscard]] bool valid() const { return id_ >= 0; }
  [[nodiscard]] bool close() { return id_ < 0 || close_(std::exchange(id_, H5I_INVALID_HID)) >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

Handle scalar() { return {H5Screate(H5S_SCALAR), H5Sclose}; }

bool write_attribute(hid_t object, const char* name, hid_t type, const Handle& space,
                     const void* value) {
  const Handle attribute(H5Acreate2(object, name, type, space.id(), H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  return attribute.valid() && H5Awrite(attribute.id(), type, value) >= 0;
}

/// The spikes of /spikes/<population>, in order of time.
class SonataSpikeSink final : public SpikeSink {
 public:
  struct Parts {
    Handle file;
    Handle timestamps;
    Handle node_ids;
  };
  SonataSpikeSink(std::string uri, std::string path, std::string part, Parts parts)
      : uri_(std::move(uri)),
        path_(std::move(path)),
        part_(std::move(part)),
        parts_(std::move(parts)) {}
  SonataSpikeSink(const SonataSpikeSink&) = delete;
  SonataSpikeSink& operator=(const SonataSpikeSink&) = delete;
  ~SonataSpikeSink() override {
    const std::lock_guard lock(hdf5_mutex());
    static_cast<void>(close_all());
    if (!closed_ && delivered_ == 0) static_cast<void>(std::remove(part_.c_str()));
  }

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }

  [[nodiscard]] Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) override {
    for (const SpikeEvent& spike : spikes) {
      times_ms_.push_back(static_cast<double>(spike.time.count()) * 1e-6);
      node_ids_.push_back(spike.neuron - 1);
    }
    return times_ms_.size() < kBuffered ? Expected<void, SinkError>{} : flush();
  }

  [[nodiscard]] Expected<void, SinkError> flush() override {
    if (times_ms_.empty()) return {};
    const std::lock_guard lock(hdf5_mutex());
    errno = 0;
    // Everything between two flushes waits in memory, so that the file is whole but for the moment
    // in which it is written.
    if (!append(parts_.timestamps, H5T_NATIVE_DOUBLE, times_ms_.data()) ||
        !append(parts_.node_ids, H5T_NATIVE_UINT64, node_ids_.data()) ||
        H5Fflush(parts_.file.id(), H5F_SCOPE_LOCAL) < 0) {
      return trouble();
    }
    delivered_ += times_ms_.size();
    times_ms_.clear();
    node_ids_.clear();
    return {};
  }

  [[nodiscard]] Expected<void, SinkError> close() override {
    if (auto flushed = flush(); !flushed) return flushed;
    const std::lock_guard lock(hdf5_mutex());
    errno = 0;
    if (!close_all()) return trouble();
    if (std::rename(part_.c_str(), path_.c_str()) != 0) return trouble();
    closed_ = true;
    return {};
  }

  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  bool append(const Handle& dataset, hid_t type, const void* values) {
    const std::array<hsize_t, 1> start{delivered_};
    const std::array<hsize_t, 1> count{times_ms_.size()};
    const std::array<hsize_t, 1> size{start[0] + count[0]};
    if (H5Dset_extent(dataset.id(), size.data()) < 0) return false;
    const Handle file_space(H5Dget_space(dataset.id()), H5Sclose);
    const Handle memory_space(H5Screate_simple(1, count.data(), nullptr), H5Sclose);
    return H5Sselect_hyperslab(file_space.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(),
                               nullptr) >= 0 &&
           H5Dwrite(dataset.id(), type, memory_space.id(), file_space.id(), H5P_DEFAULT, values) >=
               0;
  }

  bool close_all() {
    const bool data = parts_.timestamps.close();
    const bool ids = parts_.node_ids.close();
    return parts_.file.close() && data && ids;
  }

  Expected<void, SinkError> trouble() const {
    return Unexpected<SinkError>(
        {.sentence = "cannot write " + path_ + ": " +
                     (errno != 0 ? std::strerror(errno) : "HDF5 refused") +
                     "; free some space and run again; what was written before is in " + part_});
  }

  std::string uri_;
  std::string path_;
  std::string part_;
  Parts parts_;
  bool closed_ = false;
  std::vector<double> times_ms_;
  std::vector<std::uint64_t> node_ids_;
  std::uint64_t delivered_ = 0;
};

Handle create_dataset(const Handle& group, const char* name, hid_t type) {
  const std::array<hsize_t, 1> none{0};
  const std::array<hsize_t, 1> unlimited{H5S_UNLIMITED};
  const Handle space(H5Screate_simple(1, none.data(), unlimited.data()), H5Sclose);
  const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  const std::array<hsize_t, 1> chunk{kChunk};
  H5Pset_chunk(properties.id(), 1, chunk.data());
  return {H5Dcreate2(group.id(), name, type, space.id(), H5P_DEFAULT, properties.id(), H5P_DEFAULT),
          H5Dclose};
}

/// The attribute that says how the spikes are ordered: by time.
bool write_sorting(const Handle& group) {
  const Handle type(H5Tenum_create(H5T_STD_U8LE), H5Tclose);
  std::uint8_t value = 0;
  for (const char* const name : {"none", "by_id", "by_time"}) {
    H5Tenum_insert(type.id(), name, &value);
    ++value;
  }
  const std::uint8_t by_time = 2;
  return write_attribute(group.id(), "sorting", type.id(), scalar(), &by_time);
}

bool write_units(const Handle& dataset) {
  constexpr std::string_view kUnit = "milliseconds";
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), kUnit.size());
  return write_attribute(dataset.id(), "units", type.id(), scalar(), kUnit.data());
}

bool write_version(const Handle& file) {
  const std::array<std::uint32_t, 2> version{0, 1};
  const std::array<hsize_t, 1> two{2};
  const Handle pair(H5Screate_simple(1, two.data(), nullptr), H5Sclose);
  return write_attribute(file.id(), "magic", H5T_NATIVE_UINT32, scalar(), &kMagic) &&
         write_attribute(file.id(), "version", H5T_NATIVE_UINT32, pair, version.data());
}

}  // namespace

OpenedSink open_sonata_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const std::string population = options.text("population", "merkel");
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (population.empty() || population.find_first_of("/.") != std::string::npos) {
    return bad_input("\"" + uri.text + "\": the option population must be a name without / and .");
  }
  struct stat status {};
  if (uri.path == "-" || (::stat(uri.path.c_str(), &status) == 0 && !S_ISREG(status.st_mode) &&
                          !S_ISDIR(status.st_mode))) {
    return bad_input("\"" + uri.text + "\": HDF5 is written to regular files only");
  }
  // Refuses what cannot be written in the words of every other file, and makes the .part.
  if (auto file = OutputFile::create(uri.path, setup.overwrite); !file) {
    return Unexpected<SetupError>(file.error());
  }
  const std::string part = uri.path + ".part";
  const std::lock_guard lock(hdf5_mutex());
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are ours to print
  Handle file(H5Fcreate(part.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
  const Handle spikes(H5Gcreate2(file.id(), "spikes", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                      H5Gclose);
  const Handle group(
      H5Gcreate2(spikes.id(), population.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  Handle timestamps = create_dataset(group, "timestamps", H5T_IEEE_F64LE);
  Handle node_ids = create_dataset(group, "node_ids", H5T_STD_U64LE);
  if (!timestamps.valid() || !node_ids.valid() || !write_version(file) || !write_sorting(group) ||
      !write_units(timestamps) || H5Fflush(file.id(), H5F_SCOPE_LOCAL) < 0) {
    return unavailable("cannot write " + uri.path + ": HDF5 refused; is the disk full?");
  }
  return std::make_unique<SonataSpikeSink>(
      uri.text, uri.path, part,
      SonataSpikeSink::Parts{.file = std::move(file),
                             .timestamps = std::move(timestamps),
                             .node_ids = std::move(node_ids)});
}

}  // namespace merkel
