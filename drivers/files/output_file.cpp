#include "drivers/files/output_file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace merkel {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 16U;

/// Whether something that is not a regular file is at the path.
bool is_special(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode);
}

bool exists(const std::string& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) == 0;
}

}  // namespace

Expected<OutputFile, SetupError> OutputFile::create(const std::string& path, bool overwrite) {
  if (path.empty()) return bad_input("the name of the file to write is empty");
  if (path == "-") return OutputFile("standard output", "", ::dup(STDOUT_FILENO));
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode)) {
    return bad_input("cannot write " + path + ": it is a directory; name a file in it");
  }
  if (is_special(path)) {
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor < 0) {
      return bad_input("cannot write " + path + ": " + std::strerror(errno));
    }
    return OutputFile(path, "", descriptor);
  }
  const std::string part = path + ".part";
  for (const std::string& name : {path, part}) {
    if (!overwrite && exists(name)) {
      return bad_input(name + " exists already: give --overwrite, or another name");
    }
  }
  const int flags = O_WRONLY | O_CREAT | O_CLOEXEC | (overwrite ? 0 : O_EXCL);
  const int descriptor = ::open(part.c_str(), flags, 0666);
  if (descriptor < 0) {
    const bool no_folder = errno == ENOENT;
    return bad_input("cannot write " + path + ": " + std::strerror(errno) +
                     (no_folder ? "; make its folder first" : ""));
  }
  // Two writers of one file would spoil it; a file system without locks cannot tell.
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    ::close(descriptor);
    return bad_input("cannot write " + path +
                     ": another sink or another merkel is writing it; give another name");
  }
  if (::ftruncate(descriptor, 0) != 0) {
    ::close(descriptor);
    return bad_input("cannot write " + path + ": " + std::strerror(errno));
  }
  return OutputFile(path, part, descriptor);
}

OutputFile::OutputFile(std::string path, std::string part, int descriptor)
    : path_(std::move(path)), part_(std::move(part)), descriptor_(descriptor) {
  buffer_.reserve(kBufferBytes + 4096);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      part_(std::move(other.part_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      buffer_(std::move(other.buffer_)),
      written_bytes_(other.written_bytes_),
      header_bytes_(other.header_bytes_),
      error_(std::move(other.error_)) {}

OutputFile::~OutputFile() {
  if (descriptor_ < 0) return;
  const bool header_only = written_bytes_ + buffer_.size() <= header_bytes_;
  static_cast<void>(flush());
  if (header_only && !part_.empty()) ::unlink(part_.c_str());
  ::close(descriptor_);
}

bool OutputFile::fail(int error_number, std::string_view mend) {
  if (error_.empty()) {
    error_ = "cannot write " + path_ + ": " + std::strerror(error_number) + "; " +
             std::string(mend) + (part_.empty() ? "" : "; what was written before is in " + part_);
  }
  return false;
}

bool OutputFile::write(std::string_view bytes) {
  buffer_.append(bytes);
  return buffer_.size() < kBufferBytes ? error_.empty() : flush();
}

bool OutputFile::flush() {
  if (!error_.empty()) return false;
  const std::uint64_t whole_bytes = written_bytes_;
  std::size_t done = 0;
  while (done < buffer_.size()) {
    const auto wrote = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) {
      const int error_number = errno;
      // Half a row is worse than none: take back what this flush has written.
      if (!part_.empty() && ::ftruncate(descriptor_, static_cast<off_t>(whole_bytes)) == 0) {
        written_bytes_ = whole_bytes;
      }
      return fail(error_number, error_number == ENOSPC ? "free some space and run again"
                                : error_number == EFBIG
                                    ? "raise the limit (ulimit -f) and run again"
                                    : "check the device and run again");
    }
    done += static_cast<std::size_t>(wrote);
    written_bytes_ += static_cast<std::uint64_t>(wrote);
  }
  buffer_.clear();
  return true;
}

bool OutputFile::close() {
  if (!flush()) return false;
  if (::close(std::exchange(descriptor_, -1)) != 0) return fail(errno, "check the device");
  if (!part_.empty() && std::rename(part_.c_str(), path_.c_str()) != 0) {
    return fail(errno, "rename it by hand");
  }
  return true;
}

}  // namespace merkel
