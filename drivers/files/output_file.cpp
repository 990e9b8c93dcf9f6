#include "drivers/files/output_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "drivers/files/file_rename.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/files/owned_descriptor.hpp"
#include "drivers/files/utc_text.hpp"

namespace merkel {
namespace {

using std::chrono::steady_clock;

constexpr std::size_t kBufferBytes = std::size_t{1} << 16U;
constexpr std::chrono::seconds kReaderPatience{10};
constexpr std::chrono::milliseconds kLook{20};

std::string cannot_write(const std::string& path, int error_number) {
  return "cannot write " + path + ": " + std::strerror(error_number);
}

/// True if the locked file still has this name, has no other link, and is regular.
bool is_still(int descriptor, const std::string& name) {
  struct stat open_file {};
  struct stat named {};
  return ::fstat(descriptor, &open_file) == 0 && ::lstat(name.c_str(), &named) == 0 &&
         open_file.st_ino == named.st_ino && open_file.st_dev == named.st_dev &&
         S_ISREG(named.st_mode) && open_file.st_nlink == 1;
}

Unexpected<SetupError> in_use(const std::string& path) {
  return bad_input("cannot write " + path +
                   ": another sink or merkel process is writing it; give another name");
}

/// Renames a file to the first free recovered name of `path`. \return the name
Expected<std::string, SetupError> rename_recovered(const std::string& file, const std::string& path,
                                                   const struct stat& status) {
  const auto last_written = std::chrono::system_clock::from_time_t(status.st_mtim.tv_sec);
  for (int number = 1; number < 100; ++number) {
    const std::string free = recovered_name(path, last_written, number);
    const int error = rename_without_replacing(file, free);
    if (error == EEXIST) continue;
    if (error != 0) return bad_input("cannot rename " + file + ": " + std::strerror(error));
    return free;
  }
  return bad_input(file + " was left by a killed run: rename it, or give another name");
}

/// Renames the .part file of a killed run to a recovered name. Does nothing if there is none; fails
/// if another program is still writing it. \return the recovered name
Expected<std::string, SetupError> recover(const std::string& path, const std::string& part,
                                          const OutputFile::Notice& notice) {
  const OwnedDescriptor file(::open(part.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (file.get() < 0 && errno == ENOENT) return std::string();
  if (file.get() < 0) return bad_input(cannot_write(part, errno) + "; give another name");
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) return in_use(path);
  if (!is_still(file.get(), part)) {
    return bad_input(part + " was not written by merkel: remove it, or use another name");
  }
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) return bad_input(cannot_write(part, errno));
  if (status.st_size == 0) {
    if (::unlink(part.c_str()) == 0) return std::string();
    return bad_input(cannot_write(part, errno));
  }
  const auto renamed = rename_recovered(part, path, status);
  if (renamed && notice) notice("a killed run left " + part + "; it was renamed to " + *renamed);
  return renamed;
}

}  // namespace

std::string recover_file(const std::string& path, const OutputFile::Notice& notice) {
  const std::string part = path + ".part";
  {
    const OwnedDescriptor file(
        ::open(part.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    struct stat status {};
    const bool mine = file.get() >= 0 && ::flock(file.get(), LOCK_EX | LOCK_NB) == 0 &&
                      is_still(file.get(), part) && ::fstat(file.get(), &status) == 0;
    if (!mine) return {};
    if (status.st_size > 0 && rename_without_replacing(part, path) == 0) {
      static_cast<void>(sync_directory_of(path));
      if (notice) notice("a killed run left " + part + "; it was renamed to " + path);
      return path;
    }
  }
  return recover(path, part, notice).value_or("");
}

void set_aside(const std::string& path) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) return;
  static_cast<void>(rename_recovered(path, path, status));
}

std::string recovered_name(const std::string& path,
                           std::chrono::system_clock::time_point last_written, int number) {
  const std::string stamp =
      utc_text(std::chrono::system_clock::to_time_t(last_written), ".recovered-%Y%m%dT%H%M%S");
  const auto name = path.rfind('/') == std::string::npos ? 0 : path.rfind('/') + 1;
  const auto dot = path.rfind('.');
  const auto end = dot == std::string::npos || dot <= name ? path.size() : dot;
  return path.substr(0, end) + stamp + (number > 1 ? "-" + std::to_string(number) : "") +
         path.substr(end);
}

Expected<OutputFile, SetupError> OutputFile::create_special(const std::string& path) {
  const auto deadline = steady_clock::now() + kReaderPatience;
  for (;;) {
    // A non-blocking open fails while no program reads the FIFO.
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (descriptor >= 0) return OutputFile(path, "", descriptor, false);
    if (errno != ENXIO) return bad_input(cannot_write(path, errno));
    if (steady_clock::now() > deadline) {
      return bad_input(cannot_write(path, ENXIO) + ": no program reads this pipe; start its " +
                       "reader, then run again");
    }
    std::this_thread::sleep_for(kLook);
  }
}

bool is_special_output(const std::string& path) {
  struct stat status {};
  return path == "-" || (::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode) &&
                         !S_ISDIR(status.st_mode));
}

Expected<void, SetupError> check_writable(const std::string& path, bool overwrite) {
  if (auto unread = ReadFiles::check_not_read(path); !unread) return unread;
  if (overwrite || !file_exists(path)) return {};
  return bad_input(path + " already exists: add --overwrite, or give another name");
}

Expected<OutputFile, SetupError> OutputFile::create(const std::string& path, bool overwrite,
                                                    const Notice& notice) {
  if (path.empty()) return bad_input("the name of the file to write is empty");
  if (path == "-") {
    const int copy = ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3);
    if (copy < 0) return bad_input(cannot_write("standard output", errno));
    return OutputFile("standard output", "", copy, false);
  }
  struct stat status {};
  const bool there = ::stat(path.c_str(), &status) == 0;
  if (there && S_ISDIR(status.st_mode)) {
    return bad_input("cannot write " + path + ": it is a directory; give a file in it");
  }
  if (there && !S_ISREG(status.st_mode)) return create_special(path);
  if (auto free = check_writable(path, overwrite); !free) {
    return Unexpected<SetupError>(free.error());
  }
  const std::string part = path + ".part";
  const auto recovered = recover(path, part, notice);
  if (!recovered) return Unexpected<SetupError>(recovered.error());
  OwnedDescriptor file(
      ::open(part.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666));
  if (file.get() < 0) {
    if (errno == EEXIST) return in_use(path);
    return bad_input(cannot_write(path, errno) +
                     (errno == ENOENT ? "; create its folder first" : ""));
  }
  // Excludes a second writer of the file, except on file systems without locks.
  if ((::flock(file.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) ||
      !is_still(file.get(), part)) {
    return in_use(path);
  }
  OutputFile output(path, part, file.release(), overwrite);
  output.recovered_ = *recovered;
  return output;
}

OutputFile::OutputFile(std::string path, std::string part, int descriptor, bool overwrite)
    : path_(std::move(path)),
      part_(std::move(part)),
      descriptor_(descriptor),
      overwrite_(overwrite) {
  buffer_.reserve(kBufferBytes + 4096);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      part_(std::move(other.part_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      overwrite_(other.overwrite_),
      recovered_(std::move(other.recovered_)),
      buffer_(std::move(other.buffer_)),
      written_bytes_(other.written_bytes_),
      header_bytes_(other.header_bytes_),
      last_flush_(other.last_flush_),
      given_up_(std::move(other.given_up_)),
      error_(std::move(other.error_)) {}

OutputFile::~OutputFile() {
  if (descriptor_ < 0) return;
  const bool header_only = written_bytes_ + buffer_.size() <= header_bytes_;
  static_cast<void>(flush());
  if (header_only && !part_.empty() && is_still(descriptor_, part_)) ::unlink(part_.c_str());
  ::close(descriptor_);
}

bool OutputFile::fail(int error_number, std::string_view remedy) {
  if (error_.empty()) {
    error_ = cannot_write(path_, error_number) + "; " + std::string(remedy) +
             (part_.empty() ? "" : std::string(kEarlierDataIn) + part_);
  }
  return false;
}

bool OutputFile::write(std::string_view bytes) {
  buffer_.append(bytes);
  return buffer_.size() < kBufferBytes ? flush_if_due() : flush();
}

bool OutputFile::flush_if_due() {
  if (!error_.empty()) return false;
  return steady_clock::now() - last_flush_ < kFlushAfter || flush();
}

bool OutputFile::wait_for_room() {
  while (!given_up_->load(std::memory_order_relaxed)) {
    pollfd room{.fd = descriptor_, .events = POLLOUT, .revents = 0};
    if (::poll(&room, 1, static_cast<int>(kLook.count())) != 0) return true;
  }
  return fail(ETIMEDOUT,
              "the program at the other end stopped reading; restart it, then run again");
}

bool OutputFile::write_out(std::size_t& done) {
  while (done < buffer_.size()) {
    std::size_t count = buffer_.size() - done;
    if (part_.empty()) {
      if (!wait_for_room()) return false;
      count = std::min<std::size_t>(count, PIPE_BUF);  // a writable pipe accepts this much at once
    }
    const auto wrote = ::write(descriptor_, buffer_.data() + done, count);
    if (wrote < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (wrote < 0) {
      return fail(errno, errno == ENOSPC  ? "free some space and run again"
                         : errno == EFBIG ? "raise the limit (ulimit -f) and run again"
                         : errno == EPIPE ? "the program that reads it has exited"
                                          : "check the device and run again");
    }
    done += static_cast<std::size_t>(wrote);
    written_bytes_ += static_cast<std::uint64_t>(wrote);
  }
  return true;
}

bool OutputFile::flush() {
  last_flush_ = steady_clock::now();
  if (!error_.empty()) return false;
  const std::uint64_t whole_bytes = written_bytes_;
  std::size_t done = 0;
  if (!write_out(done)) {
    // A partial row is worse than none: undo this flush.
    if (!part_.empty() && ::ftruncate(descriptor_, static_cast<off_t>(whole_bytes)) == 0) {
      written_bytes_ = whole_bytes;
    }
    return false;
  }
  buffer_.clear();
  return true;
}

bool OutputFile::rewrite(std::uint64_t place, std::string_view bytes) {
  if (!flush()) return false;
  while (!bytes.empty()) {
    const auto wrote = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(place));
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return fail(errno, "check the disk and run again");
    bytes.remove_prefix(static_cast<std::size_t>(wrote));
    place += static_cast<std::uint64_t>(wrote);
  }
  return true;
}

bool OutputFile::publish() {
  if (const int unsafe = sync_file(descriptor_); unsafe != 0) return fail(unsafe, "check the disk");
  // The file was renamed or replaced by another program: leave both alone.
  if (!is_still(descriptor_, part_))
    return fail(ESTALE, "another program moved or replaced the .part file");
  const int error = rename_to(part_, path_, overwrite_);
  if (error == EEXIST) return fail(error, "it was created during the run and is not replaced");
  if (error != 0) return fail(error, "rename the .part file by hand");
  part_.clear();
  const int unsafe = sync_directory_of(path_);
  return unsafe == 0 || fail(unsafe, "the rename is not yet on disk and a power cut may undo it");
}

bool OutputFile::close() {
  if (!flush()) return false;
  if (!part_.empty() && !publish()) return false;
  if (::close(std::exchange(descriptor_, -1)) != 0) return fail(errno, "check the device");
  return true;
}

void OutputFile::remove() noexcept {
  if (descriptor_ < 0 || part_.empty()) return;
  if (is_still(descriptor_, part_)) ::unlink(part_.c_str());
  buffer_.clear();
  part_.clear();
  ::close(std::exchange(descriptor_, -1));
}

}  // namespace merkel
