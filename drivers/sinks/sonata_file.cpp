#include "drivers/sinks/sonata_file.hpp"

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <functional>
#include <mutex>
#include <string_view>

#include <fcntl.h>
#include <hdf5.h>
#include <unistd.h>

#include "drivers/files/csv_text.hpp"
#include "drivers/files/file_rename.hpp"
#include "drivers/files/line_reader.hpp"

namespace merkel {
namespace {

constexpr hsize_t kChunk = 16384;         ///< spikes per chunk of the file
constexpr std::uint32_t kMagic = 0x0A7A;  ///< in every SONATA file

/// The library has global state and is not built for threads: one file at a time. At the end of
/// the program, the library would write a file that it failed to close once more, and crash. Its
/// exit handler is therefore disabled, and every file is closed here.
std::mutex& hdf5_mutex() {
  static std::mutex mutex;
  static const herr_t no_ending = H5dont_atexit();
  static_cast<void>(no_ending);
  return mutex;
}

/// An HDF5 handle, closed by the function of its kind.
class Handle {
 public:
  Handle(hid_t id, herr_t (*closer)(hid_t)) : id_(id), close_(closer) {}
  Handle(Handle&&) = delete;
  ~Handle() { static_cast<void>(close()); }
  [[nodiscard]] hid_t id() const { return id_; }
  [[nodiscard]] bool valid() const { return id_ >= 0; }
  [[nodiscard]] bool close() { return id_ < 0 || close_(std::exchange(id_, H5I_INVALID_HID)) >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

bool write_attribute(hid_t object, const char* name, hid_t type, hid_t space, const void* value) {
  const Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.valid() && H5Awrite(attribute.id(), type, value) >= 0;
}

bool write_scalar(hid_t object, const char* name, hid_t type, const void* value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  return write_attribute(object, name, type, space.id(), value);
}

/// Of variable length, as readers expect of SONATA's attributes.
bool write_text(hid_t object, const char* name, const std::string& text) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), H5T_VARIABLE);
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  const char* const value = text.c_str();
  return write_scalar(object, name, type.id(), &value);
}

/// Writes the order of the spikes: by time.
bool write_sorting(hid_t group) {
  const Handle type(H5Tenum_create(H5T_STD_U8LE), H5Tclose);
  std::uint8_t value = 0;
  for (const char* const name : {"none", "by_id", "by_time"}) {
    H5Tenum_insert(type.id(), name, &value);
    ++value;
  }
  const std::uint8_t by_time = 2;
  return write_scalar(group, "sorting", type.id(), &by_time);
}

bool write_version(hid_t file) {
  const std::array<std::uint32_t, 2> version{0, 1};
  const std::array<hsize_t, 1> two{2};
  const Handle pair(H5Screate_simple(1, two.data(), nullptr), H5Sclose);
  return write_scalar(file, "magic", H5T_NATIVE_UINT32, &kMagic) &&
         write_attribute(file, "version", H5T_NATIVE_UINT32, pair.id(), version.data());
}

/// A growing list of values.
class Column {
 public:
  Column(hid_t group, const char* name, hid_t type)
      : dataset_(
            [&] {
              const std::array<hsize_t, 1> none{0};
              const std::array<hsize_t, 1> unlimited{H5S_UNLIMITED};
              const std::array<hsize_t, 1> chunk{kChunk};
              const Handle space(H5Screate_simple(1, none.data(), unlimited.data()), H5Sclose);
              const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
              H5Pset_chunk(properties.id(), 1, chunk.data());
              return H5Dcreate2(group, name, type, space.id(), H5P_DEFAULT, properties.id(),
                                H5P_DEFAULT);
            }(),
            H5Dclose) {}
  [[nodiscard]] Handle& dataset() { return dataset_; }

  template <class Value>
  [[nodiscard]] bool append(hid_t type, const std::vector<Value>& values) {
    const std::array<hsize_t, 1> start{size_};
    const std::array<hsize_t, 1> count{values.size()};
    size_ += values.size();
    const std::array<hsize_t, 1> size{size_};
    if (values.empty()) return true;
    if (H5Dset_extent(dataset_.id(), size.data()) < 0) return false;
    const Handle file_space(H5Dget_space(dataset_.id()), H5Sclose);
    const Handle memory_space(H5Screate_simple(1, count.data(), nullptr), H5Sclose);
    return H5Sselect_hyperslab(file_space.id(), H5S_SELECT_SET, start.data(), nullptr, count.data(),
                               nullptr) >= 0 &&
           H5Dwrite(dataset_.id(), type, memory_space.id(), file_space.id(), H5P_DEFAULT,
                    values.data()) >= 0;
  }
  template <class Value>
  [[nodiscard]] bool write(hid_t type, const std::vector<Value>& values) {
    return dataset_.valid() && append(type, values) && dataset_.close();
  }

 private:
  Handle dataset_;
  hsize_t size_ = 0;
};

Handle group_in(hid_t place, const std::string& name) {
  return {H5Gcreate2(place, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose};
}

/// Copies the comment lines and checks the header of the rows.
bool read_head(LineReader& lines, hid_t group) {
  while (lines.next() == LineReader::Outcome::kLine) {
    const std::string line(lines.line());
    if (!line.starts_with("# ")) return true;
    const auto equals = line.find('=');
    if (equals == std::string::npos ||
        !write_text(group, line.substr(2, equals - 2).c_str(), line.substr(equals + 1))) {
      return false;
    }
  }
  return false;
}

/// Writes the spikes from their rows.
bool write_spikes(hid_t file, const SonataContent& content) {
  Handle spikes = group_in(file, "spikes");
  Handle group = group_in(spikes.id(), content.population);
  if (!group.valid() || !write_sorting(group.id())) return false;
  Column timestamps(group.id(), "timestamps", H5T_IEEE_F64LE);
  Column node_ids(group.id(), "node_ids", H5T_STD_U64LE);
  if (!timestamps.dataset().valid() || !node_ids.dataset().valid() ||
      !write_text(timestamps.dataset().id(), "units", "ms")) {
    return false;
  }
  auto lines = LineReader::open(content.rows);
  if (!lines || !read_head(*lines, group.id())) return false;
  std::vector<double> times;
  std::vector<std::uint64_t> nodes;
  LineReader::Outcome outcome = LineReader::Outcome::kLine;
  while (outcome == LineReader::Outcome::kLine) {
    times.clear();
    nodes.clear();
    while (times.size() < kChunk && (outcome = lines->next()) == LineReader::Outcome::kLine) {
      std::string_view row = lines->line();
      const auto time = parse_number(take_field(row));
      std::uint64_t node = 0;
      if (!time || std::from_chars(row.data(), row.data() + row.size(), node).ec != std::errc{}) {
        return false;
      }
      times.push_back(*time);
      nodes.push_back(node);
    }
    if (!timestamps.append(H5T_NATIVE_DOUBLE, times) ||
        !node_ids.append(H5T_NATIVE_UINT64, nodes)) {
      return false;
    }
  }
  return outcome == LineReader::Outcome::kEnd && timestamps.dataset().close() &&
         node_ids.dataset().close() && group.close() && spikes.close();
}

/// Writes the afferents as SONATA nodes: one type, one group of attributes.
bool write_nodes(hid_t file, const SonataContent& content) {
  if (content.afferents.empty()) return true;
  Handle nodes = group_in(file, "nodes");
  Handle group = group_in(nodes.id(), content.population);
  Handle attributes = group_in(group.id(), "0");
  if (!attributes.valid()) return false;
  const auto ids = [&](const char* name,
                       const std::function<std::uint64_t(const AfferentRow&)>& of) {
    std::vector<std::uint64_t> values;
    for (const AfferentRow& row : content.afferents) values.push_back(of(row));
    return Column(group.id(), name, H5T_STD_U64LE).write(H5T_NATIVE_UINT64, values);
  };
  const auto numbers = [&](const char* name, const std::function<double(const AfferentRow&)>& of) {
    std::vector<double> values;
    for (const AfferentRow& row : content.afferents) values.push_back(of(row));
    return Column(attributes.id(), name, H5T_IEEE_F64LE).write(H5T_NATIVE_DOUBLE, values);
  };
  return ids("node_id", [](const AfferentRow& row) { return row.number - 1; }) &&
         ids("node_type_id", [](const AfferentRow&) { return 0; }) &&
         ids("node_group_id", [](const AfferentRow&) { return 0; }) &&
         ids("node_group_index", [](const AfferentRow& row) { return row.number - 1; }) &&
         // SONATA's positions are in µm.
         numbers("x", [](const AfferentRow& row) { return 1e3 * row.x_mm; }) &&
         numbers("y", [](const AfferentRow& row) { return 1e3 * row.y_mm; }) &&
         numbers("field_radius_mm", [](const AfferentRow& row) { return row.field_radius_mm; }) &&
         numbers("patch", [](const AfferentRow& row) { return static_cast<double>(row.patch); }) &&
         attributes.close() && group.close() && nodes.close();
}

bool write_all(const std::string& path, const SonataContent& content) {
  Handle file(H5Fcreate(path.c_str(), H5F_ACC_EXCL, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
  return file.valid() && write_version(file.id()) && write_spikes(file.id(), content) &&
         write_nodes(file.id(), content) && H5Fflush(file.id(), H5F_SCOPE_LOCAL) >= 0 &&
         file.close();
}

int sync_file(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (descriptor < 0) return errno;
  const int error = ::fsync(descriptor) == 0 || errno == EINVAL ? 0 : errno;
  ::close(descriptor);
  return error;
}

}  // namespace

Expected<void, std::string> write_sonata(const std::string& path, const SonataContent& content,
                                         bool overwrite) {
  const std::lock_guard lock(hdf5_mutex());
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are printed here
  const auto refused = [&](int error_number) {
    return Unexpected<std::string>(
        "cannot write " + path + ": " +
        (error_number != 0 ? std::strerror(error_number) : "HDF5 refused"));
  };
  std::string unfinished = path + ".part.h5";
  for (int number = 2; ::access(unfinished.c_str(), F_OK) == 0; ++number) {
    unfinished = path + ".part-" + std::to_string(number) + ".h5";
  }
  errno = 0;
  if (!write_all(unfinished, content)) {
    const int error_number = errno;
    ::unlink(unfinished.c_str());
    return refused(error_number);
  }
  int error = sync_file(unfinished);
  if (error == 0) {
    error = overwrite ? (std::rename(unfinished.c_str(), path.c_str()) == 0 ? 0 : errno)
                      : rename_without_replacing(unfinished, path);
  }
  if (error == 0) error = sync_directory_of(path);
  if (error == 0) return {};
  ::unlink(unfinished.c_str());
  return refused(error);
}

}  // namespace merkel
