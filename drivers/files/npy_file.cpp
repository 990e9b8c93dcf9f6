#include "drivers/files/npy_file.hpp"

#include <bit>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace merkel {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kHeaderBytes = 128;

/// Version 1.0: magic, length of the text, text padded with blanks up to a line feed.
std::string header_of(std::string_view type, std::uint64_t values) {
  std::string header("\x93NUMPY\x01\x00", 8);
  header += static_cast<char>(kHeaderBytes - 10);
  header += '\0';
  header += "{'descr': '" + std::string(type) + "', 'fortran_order': False, 'shape': (" +
            std::to_string(values) + ",), }";
  header.resize(kHeaderBytes - 1, ' ');
  return header + '\n';
}

}  // namespace

Expected<NpyFile, SetupError> NpyFile::create(const std::string& path, std::string_view type,
                                              bool overwrite) {
  const int flags = O_WRONLY | O_CREAT | O_CLOEXEC | (overwrite ? O_TRUNC : O_EXCL);
  const int descriptor = ::open(path.c_str(), flags, 0666);
  if (descriptor < 0) {
    return bad_input(errno == EEXIST ? path + " exists already: give --overwrite, or another name"
                                     : "cannot write " + path + ": " + std::strerror(errno));
  }
  NpyFile file(path, type, descriptor);
  if (!file.flush()) return unavailable(file.error());
  return file;
}

NpyFile::NpyFile(std::string path, std::string_view type, int descriptor)
    : path_(std::move(path)),
      type_(type),
      descriptor_(descriptor),
      value_bytes_(static_cast<std::size_t>(type.back() - '0')) {}

NpyFile::NpyFile(NpyFile&& other) noexcept
    : path_(std::move(other.path_)),
      type_(std::move(other.type_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      value_bytes_(other.value_bytes_),
      buffer_(std::move(other.buffer_)),
      values_(other.values_),
      error_(std::move(other.error_)) {}

NpyFile::~NpyFile() {
  if (descriptor_ < 0) return;
  static_cast<void>(flush());
  ::close(descriptor_);
}

void NpyFile::append(std::int64_t value) {
  buffer_.append(reinterpret_cast<const char*>(&value), value_bytes_);
}

bool NpyFile::write_at(std::uint64_t place, std::string_view bytes) {
  while (!bytes.empty()) {
    const auto wrote = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(place));
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) {
      error_ = "cannot write " + path_ + ": " + std::strerror(errno) +
               "; free some space and run again; what was written before is there";
      return false;
    }
    bytes.remove_prefix(static_cast<std::size_t>(wrote));
    place += static_cast<std::uint64_t>(wrote);
  }
  return true;
}

bool NpyFile::flush() {
  if (!error_.empty()) return false;
  if (!write_at(kHeaderBytes + values_ * value_bytes_, buffer_)) return false;
  const std::uint64_t values = values_ + buffer_.size() / value_bytes_;
  buffer_.clear();
  if (!write_at(0, header_of(type_, values))) return false;
  values_ = values;
  return true;
}

}  // namespace merkel
