// NWB files whose objects have any type, shape and content. The bytes
// select the objects; the HDF5 library writes them, because arbitrary bytes would test the library.
// Built and run by fuzz.sh with libFuzzer.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>
#include <hdf5.h>
#include <unistd.h>

#include "drivers/files/hdf5_file.hpp"
#include "drivers/spike_files/spike_file.hpp"

namespace {

/// A file in memory, removed at the end. HDF5 does not create files that have no real path.
class ShortLivedFile {
 public:
  ShortLivedFile() = default;
  ShortLivedFile(const ShortLivedFile&) = delete;
  ShortLivedFile& operator=(const ShortLivedFile&) = delete;
  ~ShortLivedFile() { ::unlink(path_.c_str()); }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_ = "/dev/shm/merkel-fuzz-" + std::to_string(::getpid()) + ".h5";
};

/// Writes objects of a file as the bytes select.
class AnyFile {
 public:
  AnyFile(const std::string& path, FuzzedDataProvider& bytes)
      : bytes_(bytes), file_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {
    if (file_ < 0) std::abort();
  }
  AnyFile(const AnyFile&) = delete;
  AnyFile& operator=(const AnyFile&) = delete;
  ~AnyFile() { H5Fclose(file_); }

  /// An object, or none.
  void object(const char* path) {
    switch (bytes_.ConsumeIntegralInRange(0, 9)) {
      case 0:
        return;
      case 1:
        return close_group(H5Gcreate2(file_, path, links(), H5P_DEFAULT, H5P_DEFAULT));
      case 2:
        H5Lcreate_soft(bytes_.PickValueInArray(kPaths), file_, path, links(), H5P_DEFAULT);
        return;
      default:
        return dataset(path);
    }
  }
  static constexpr const char* kPaths[] = {"/units", "/units/spike_times",
                                           "/units/spike_times_index", "/general/notes"};

 private:
  static void close_group(hid_t group) {
    if (group >= 0) H5Gclose(group);
  }
  static hid_t links() {
    static const hid_t properties = [] {
      const hid_t made = H5Pcreate(H5P_LINK_CREATE);
      H5Pset_create_intermediate_group(made, 1);
      return made;
    }();
    return properties;
  }
  hid_t type() {
    const auto kind = bytes_.ConsumeIntegralInRange<std::size_t>(0, 9);
    if (kind < 7) {
      const std::array<hid_t, 7> numbers = {H5T_IEEE_F64LE, H5T_IEEE_F32LE, H5T_STD_U64LE,
                                            H5T_STD_I64BE,  H5T_STD_U32LE,  H5T_STD_U8LE,
                                            H5T_STD_B16LE};
      return H5Tcopy(numbers[kind]);
    }
    const hid_t text = H5Tcopy(H5T_C_S1);
    H5Tset_size(text, kind == 7 ? 5 : H5T_VARIABLE);
    if (kind == 9) H5Tset_cset(text, H5T_CSET_UTF8);
    return text;
  }
  /// \param large  it may be a dataset of far more values than the file has
  hid_t space(bool large) {
    const int rank = bytes_.ConsumeIntegralInRange(0, 3);
    if (rank == 0) return H5Screate(bytes_.ConsumeBool() ? H5S_NULL : H5S_SCALAR);
    std::array<hsize_t, 3> size{};
    for (hsize_t& each : size) each = bytes_.ConsumeIntegralInRange<hsize_t>(0, 5);
    if (large) size[0] = bytes_.ConsumeIntegral<std::uint32_t>();
    return H5Screate_simple(rank, size.data(), nullptr);
  }
  /// A dataset; a large one is never written.
  void dataset(const char* path) {
    const bool large = bytes_.ConsumeIntegralInRange(0, 7) == 0;
    const hid_t kind = type();
    const hid_t shape = space(large);
    const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
    const int rank = H5Sget_simple_extent_ndims(shape);
    const std::array<hsize_t, 3> chunk{4, 1, 1};
    if (rank > 0 && large) H5Pset_chunk(properties, rank, chunk.data());
    const hid_t made = H5Dcreate2(file_, path, kind, shape, links(), properties, H5P_DEFAULT);
    if (made >= 0 && !large) {
      fill(kind, shape, [&](const void* values) {
        H5Dwrite(made, kind, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
      });
    }
    if (made >= 0) H5Dclose(made);
    H5Pclose(properties);
    H5Sclose(shape);
    H5Tclose(kind);
  }
  template <class Write>
  void fill(hid_t kind, hid_t shape, const Write& write) {
    const auto count =
        static_cast<std::size_t>(std::max<hssize_t>(0, H5Sget_simple_extent_npoints(shape)));
    if (count == 0) return;
    if (H5Tis_variable_str(kind) > 0) {
      static constexpr const char* kTexts[] = {"time_offset_ns = 5\nstart_device_ns = 7\n", "12",
                                               "-9223372036854775808", "", "x"};
      std::vector<const char*> texts(count);
      for (const char*& text : texts) text = bytes_.PickValueInArray(kTexts);
      return write(texts.data());
    }
    std::vector<std::uint8_t> values = bytes_.ConsumeBytes<std::uint8_t>(count * H5Tget_size(kind));
    values.resize(count * H5Tget_size(kind));
    write(values.data());
  }

  FuzzedDataProvider& bytes_;
  hid_t file_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  static const ShortLivedFile short_lived;
  const std::string& path = short_lived.path();
  FuzzedDataProvider bytes(data, size);
  {
    const std::lock_guard lock(hdf5_mutex());
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    AnyFile made(path, bytes);
    for (const char* const object : AnyFile::kPaths) made.object(object);
  }
  const auto file = read_nwb_spikes(path);
  if (!file) {
    if (file.error().sentence.empty()) std::abort();
    return 0;
  }
  if (file->spikes.size() > 1000) std::abort();
  for (const RecordedSpike& spike : file->spikes) {
    if (spike.neuron == 0) std::abort();
  }
  return 0;
}
