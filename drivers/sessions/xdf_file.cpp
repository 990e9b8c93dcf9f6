#include "drivers/sessions/xdf_file.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>

#include <sys/stat.h>

#include "drivers/files/input_file.hpp"

namespace merkel {
namespace {

/// The longest chunk of a session; longer ones are skipped.
constexpr std::uint64_t kMaxChunk = std::uint64_t{16} << 20U;
constexpr std::string_view kXdfMagic = "XDF:";

}  // namespace

Expected<XdfFile, SetupError> XdfFile::open(const std::string& path) {
  std::unique_ptr<std::FILE, Close> opened(std::fopen(path.c_str(), "rb"));
  struct stat status {};
  if (!opened || ::fstat(::fileno(opened.get()), &status) != 0) {
    return bad_input("cannot read the session " + path + ": " + std::strerror(errno));
  }
  if (!S_ISREG(status.st_mode)) return bad_input(path + " is not a file: use a session (.xdf)");
  ReadFiles::note(path);
  XdfFile file(path, std::move(opened), static_cast<std::uint64_t>(status.st_size));
  std::array<char, kXdfMagic.size()> magic{};
  if (!file.read_bytes(magic.data(), magic.size()) ||
      std::string_view(magic.data(), magic.size()) != kXdfMagic) {
    return bad_input(
        path +
        " is not a session recorded by the sink xdf: (it does not start with \"XDF:\"); a "
        "trace is played by merkel run --fast --probe replay:FILE");
  }
  return file;
}

void XdfFile::rewind() {
  place_ = kXdfMagic.size();
  truncated_ = ::fseeko(file_.get(), static_cast<off_t>(place_), SEEK_SET) != 0;
}

bool XdfFile::read_bytes(void* bytes, std::size_t count) {
  if (std::fread(bytes, 1, count, file_.get()) != count) return false;
  place_ += count;
  return true;
}

Unexpected<SetupError> XdfFile::damaged(const std::string& what) const {
  return bad_input("the session " + path_ + " is damaged at byte " + std::to_string(chunk_start_) +
                   ": " + what);
}

Expected<bool, SetupError> XdfFile::next(XdfChunk& chunk) {
  for (;;) {
    chunk_start_ = place_;
    if (truncated_ || place_ == size_) return false;
    std::uint8_t width = 0;
    std::uint64_t length = 0;
    if (!read_bytes(&width, 1)) return damaged("the file is unreadable");
    if (width != 1 && width != 4 && width != 8) return damaged("a chunk has an invalid length");
    std::uint16_t tag = 0;
    if (!read_bytes(&length, width) || length > size_ - place_) {
      truncated_ = true;  // the writer stopped within this chunk
      return false;
    }
    if (length < sizeof tag || !read_bytes(&tag, sizeof tag)) {
      return damaged("a chunk is too short");
    }
    const std::uint64_t rest = length - sizeof tag;
    if (length > kMaxChunk) {
      if (::fseeko(file_.get(), static_cast<off_t>(rest), SEEK_CUR) != 0) {
        return damaged("the file is unreadable");
      }
      place_ += rest;
      continue;
    }
    chunk.tag = static_cast<XdfTag>(tag);
    chunk.content.resize(rest);
    if (!read_bytes(chunk.content.data(), rest)) {
      truncated_ = true;
      return false;
    }
    return true;
  }
}

}  // namespace merkel
