#include "drivers/files/hdf5_file.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <type_traits>
#include <utility>

#include <hdf5.h>
#include <unistd.h>

#include "drivers/files/file_rename.hpp"
#include "drivers/files/hdf5_handle.hpp"
#include "drivers/printable_text.hpp"

namespace merkel {
namespace {

static_assert(std::is_same_v<hid_t, std::int64_t>);

constexpr hsize_t kChunk = 4096;  ///< rows of a chunk of a column

Hdf5Handle text_type() {
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  return {type, H5Tclose};
}

Hdf5Handle scalar() { return {H5Screate(H5S_SCALAR), H5Sclose}; }

Hdf5Handle list_of(std::size_t count) {
  const hsize_t size = count;
  return {H5Screate_simple(1, &size, nullptr), H5Sclose};
}

Hdf5Handle intermediate_groups() {
  const hid_t properties = H5Pcreate(H5P_LINK_CREATE);
  H5Pset_create_intermediate_group(properties, 1);
  return {properties, H5Pclose};
}

/// A dataset that can grow along its first dimension.
hid_t growing_dataset(hid_t file, const std::string& path, hid_t type, std::size_t width,
                      hsize_t rows) {
  const int rank = width > 1 ? 2 : 1;
  const std::array<hsize_t, 2> size{rows, width};
  const std::array<hsize_t, 2> most{H5S_UNLIMITED, width};
  const std::array<hsize_t, 2> chunk{rows > 0 ? rows : kChunk, width};
  const Hdf5Handle space(H5Screate_simple(rank, size.data(), most.data()), H5Sclose);
  const Hdf5Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_chunk(properties.id(), rank, chunk.data());
  const Hdf5Handle links = intermediate_groups();
  return H5Dcreate2(file, path.c_str(), type, space.id(), links.id(), properties.id(), H5P_DEFAULT);
}

hid_t file_type(Hdf5File::Type type) {
  switch (type) {
    case Hdf5File::Type::kDouble:
      return H5T_IEEE_F64LE;
    case Hdf5File::Type::kUint64:
      return H5T_STD_U64LE;
    case Hdf5File::Type::kInt64:
      return H5T_STD_I64LE;
    case Hdf5File::Type::kUint32:
      return H5T_STD_U32LE;
    case Hdf5File::Type::kUint8:
      return H5T_STD_U8LE;
  }
  return H5T_IEEE_F64LE;
}

/// Texts as HDF5 takes them: pointers to UTF-8.
class TextPointers {
 public:
  explicit TextPointers(std::span<const std::string> texts) {
    for (const std::string& text : texts) texts_.push_back(utf8_text(text));
    for (const std::string& text : texts_) pointers_.push_back(text.c_str());
  }
  [[nodiscard]] const char* const* data() const noexcept { return pointers_.data(); }

 private:
  std::vector<std::string> texts_;
  std::vector<const char*> pointers_;
};

}  // namespace

/// A file that could not be closed would be written again at the program's end, and crash it: the
/// library's own ending is switched off, and every file is closed here.
std::mutex& hdf5_mutex() {
  static std::mutex mutex;
  static const herr_t no_ending = H5dont_atexit();
  static_cast<void>(no_ending);
  return mutex;
}

Hdf5File::Hdf5File(const std::string& path)
    : file_(H5Fcreate(path.c_str(), H5F_ACC_EXCL, H5P_DEFAULT, H5P_DEFAULT)), ok_(file_ >= 0) {}

Hdf5File::~Hdf5File() { close(); }

void Hdf5File::close() {
  if (file_ < 0) return;
  const bool flushed = H5Fflush(file_, H5F_SCOPE_LOCAL) >= 0;
  check(H5Fclose(std::exchange(file_, H5I_INVALID_HID)) >= 0 && flushed);
}

void Hdf5File::group(const std::string& path) {
  if (!ok_) return;
  const Hdf5Handle links = intermediate_groups();
  const Hdf5Handle made(H5Gcreate2(file_, path.c_str(), links.id(), H5P_DEFAULT, H5P_DEFAULT),
                        H5Gclose);
  check(made.valid());
}

void Hdf5File::write_attribute(const std::string& path, const char* name, std::int64_t type,
                               std::int64_t space, const void* value) {
  if (!ok_) return;
  const Hdf5Handle attribute(H5Acreate_by_name(file_, path.c_str(), name, type, space, H5P_DEFAULT,
                                               H5P_DEFAULT, H5P_DEFAULT),
                             H5Aclose);
  check(attribute.valid() && H5Awrite(attribute.id(), type, value) >= 0);
}

void Hdf5File::attribute(const std::string& path, const char* name, const std::string& text) {
  write_attribute(path, name, text_type().id(), scalar().id(), TextPointers({&text, 1}).data());
}

void Hdf5File::attribute(const std::string& path, const char* name,
                         std::span<const std::string> texts) {
  write_attribute(path, name, text_type().id(), list_of(texts.size()).id(),
                  TextPointers(texts).data());
}

void Hdf5File::attribute(const std::string& path, const char* name, float value) {
  write_attribute(path, name, H5T_NATIVE_FLOAT, scalar().id(), &value);
}

void Hdf5File::attribute(const std::string& path, const char* name, double value) {
  write_attribute(path, name, H5T_NATIVE_DOUBLE, scalar().id(), &value);
}

void Hdf5File::attribute(const std::string& path, const char* name, std::int32_t value) {
  write_attribute(path, name, H5T_NATIVE_INT32, scalar().id(), &value);
}

void Hdf5File::attribute(const std::string& path, const char* name, std::uint32_t value) {
  write_attribute(path, name, H5T_NATIVE_UINT32, scalar().id(), &value);
}

void Hdf5File::attribute(const std::string& path, const char* name,
                         std::span<const std::uint32_t> values) {
  write_attribute(path, name, H5T_NATIVE_UINT32, list_of(values.size()).id(), values.data());
}

void Hdf5File::word(const std::string& path, const char* name, std::span<const char* const> words,
                    std::uint8_t index) {
  const Hdf5Handle type(H5Tenum_create(H5T_STD_U8LE), H5Tclose);
  std::uint8_t value = 0;
  for (const char* const each : words) {
    H5Tenum_insert(type.id(), each, &value);
    ++value;
  }
  write_attribute(path, name, type.id(), scalar().id(), &index);
}

void Hdf5File::reference(const std::string& path, const char* name, const std::string& target) {
  if (!ok_) return;
  hobj_ref_t reference = 0;
  check(H5Rcreate(&reference, file_, target.c_str(), H5R_OBJECT, -1) >= 0);
  write_attribute(path, name, H5T_STD_REF_OBJ, scalar().id(), &reference);
}

void Hdf5File::link(const std::string& path, const std::string& target) {
  if (!ok_) return;
  check(H5Lcreate_soft(target.c_str(), file_, path.c_str(), H5P_DEFAULT, H5P_DEFAULT) >= 0);
}

void Hdf5File::number(const std::string& path, double value) {
  if (!ok_) return;
  const Hdf5Handle links = intermediate_groups();
  const Hdf5Handle dataset(H5Dcreate2(file_, path.c_str(), H5T_IEEE_F64LE, scalar().id(),
                                      links.id(), H5P_DEFAULT, H5P_DEFAULT),
                           H5Dclose);
  check(dataset.valid() &&
        H5Dwrite(dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value) >= 0);
}

void Hdf5File::text(const std::string& path, const std::string& value) {
  if (!ok_) return;
  const Hdf5Handle type = text_type();
  const Hdf5Handle links = intermediate_groups();
  const Hdf5Handle dataset(H5Dcreate2(file_, path.c_str(), type.id(), scalar().id(), links.id(),
                                      H5P_DEFAULT, H5P_DEFAULT),
                           H5Dclose);
  check(dataset.valid() && H5Dwrite(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT,
                                    TextPointers({&value, 1}).data()) >= 0);
}

void Hdf5File::texts(const std::string& path, std::span<const std::string> values) {
  if (!ok_) return;
  const Hdf5Handle type = text_type();
  const Hdf5Handle dataset(growing_dataset(file_, path, type.id(), 1, values.size()), H5Dclose);
  check(dataset.valid() &&
        (values.empty() || H5Dwrite(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT,
                                    TextPointers(values).data()) >= 0));
}

Hdf5File::Column::Column(Hdf5File& file, const std::string& path, Type type, std::size_t width)
    : file_(file),
      dataset_(file.ok_ ? growing_dataset(file.file_, path, file_type(type), width, 0)
                        : H5I_INVALID_HID),
      width_(width) {
  file_.check(dataset_ >= 0);
}

Hdf5File::Column::~Column() {
  flush();
  if (dataset_ >= 0) file_.check(H5Dclose(dataset_) >= 0);
}

void Hdf5File::Column::append(double value) {
  ++size_;
  doubles_.push_back(value);
  if (doubles_.size() == kChunk * width_) flush();
}

void Hdf5File::Column::append(std::uint64_t value) {
  ++size_;
  wholes_.push_back(value);
  if (wholes_.size() == kChunk * width_) flush();
}

void Hdf5File::Column::flush() {
  write(doubles_, H5T_NATIVE_DOUBLE);
  write(wholes_, H5T_NATIVE_UINT64);
}

template <class Value>
void Hdf5File::Column::write(std::vector<Value>& values, std::int64_t memory_type) {
  if (values.empty()) return;
  const int rank = width_ > 1 ? 2 : 1;
  const std::array<hsize_t, 2> start{written_, 0};
  const std::array<hsize_t, 2> count{values.size() / width_, width_};
  written_ += count[0];
  const std::array<hsize_t, 2> size{written_, width_};
  if (file_.ok_) {
    const bool grown = H5Dset_extent(dataset_, size.data()) >= 0;
    const Hdf5Handle file_space(H5Dget_space(dataset_), H5Sclose);
    const Hdf5Handle memory_space(H5Screate_simple(rank, count.data(), nullptr), H5Sclose);
    file_.check(grown &&
                H5Sselect_hyperslab(file_space.id(), H5S_SELECT_SET, start.data(), nullptr,
                                    count.data(), nullptr) >= 0 &&
                H5Dwrite(dataset_, memory_type, memory_space.id(), file_space.id(), H5P_DEFAULT,
                         values.data()) >= 0);
  }
  values.clear();
}

Expected<void, std::string> write_hdf5_file(const std::string& path, bool overwrite,
                                            const std::function<void(Hdf5File&)>& write) {
  const std::lock_guard lock(hdf5_mutex());
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are printed here
  std::string reason;
  const auto refused = [&](int error_number) {
    if (reason.empty()) {
      reason = error_number == EEXIST   ? "it was created during the run and is not replaced"
               : error_number == ENOSPC ? "No space left on device; free some space"
               : error_number != 0      ? std::strerror(error_number)
                                        : "HDF5 refused";
    }
    return Unexpected<std::string>("cannot write " + path + ": " + reason);
  };
  std::string unfinished = path + ".part.h5";
  for (int number = 2; ::access(unfinished.c_str(), F_OK) == 0; ++number) {
    unfinished = path + ".part-" + std::to_string(number) + ".h5";
  }
  errno = 0;
  bool written = false;
  int error_number = 0;
  {
    Hdf5File file(unfinished);
    if (file.ok()) write(file);
    file.close();
    written = file.ok();
    error_number = errno;
    reason = file.reason_;
  }
  if (!written) {
    ::unlink(unfinished.c_str());
    return refused(error_number);
  }
  int error = sync_file(unfinished);
  if (error == 0) error = rename_to(unfinished, path, overwrite);
  if (error == 0) error = sync_directory_of(path);
  if (error == 0) return {};
  ::unlink(unfinished.c_str());
  return refused(error);
}

}  // namespace merkel
