#include "drivers/files/input_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "drivers/files/owned_descriptor.hpp"

namespace merkel {
namespace {

struct LiveReadFiles {
  std::mutex mutex;
  std::vector<ReadFiles*> all;
};

LiveReadFiles& live_read_files() {
  static LiveReadFiles live;
  return live;
}

}  // namespace

ReadFiles::ReadFiles() {
  auto& live = live_read_files();
  const std::lock_guard lock(live.mutex);
  live.all.push_back(this);
}

ReadFiles::~ReadFiles() {
  auto& live = live_read_files();
  const std::lock_guard lock(live.mutex);
  std::erase(live.all, this);
}

void ReadFiles::complete() {
  const std::lock_guard lock(live_read_files().mutex);
  complete_ = true;
}

void ReadFiles::note(const std::string& path) {
  std::error_code failed;
  std::string resolved = std::filesystem::canonical(path, failed).string();
  if (failed) return;
  auto& live = live_read_files();
  const std::lock_guard lock(live.mutex);
  for (ReadFiles* const files : live.all) {
    const bool known = std::any_of(files->names_.begin(), files->names_.end(),
                                   [&](const Name& name) { return name.resolved == resolved; });
    if (!files->complete_ && !known) files->names_.push_back({path, resolved});
  }
}

Expected<void, SetupError> ReadFiles::check_not_read(const std::string& path) {
  struct stat output {};
  if (::stat(path.c_str(), &output) != 0) return {};
  if (!S_ISREG(output.st_mode) && !S_ISDIR(output.st_mode)) return {};
  auto& live = live_read_files();
  const std::lock_guard lock(live.mutex);
  for (const ReadFiles* const files : live.all) {
    for (const Name& name : files->names_) {
      // Hard links have one inode. It is asked now: that of a removed file may be in use again.
      struct stat input {};
      if (::stat(name.resolved.c_str(), &input) != 0) continue;
      if (input.st_dev != output.st_dev || input.st_ino != output.st_ino) continue;
      return bad_input("cannot write " + path + ": this command also reads it" +
                       (name.given == path ? "" : ", as " + name.given) +
                       ", and would destroy its input; give another name");
    }
  }
  return {};
}

Expected<std::string, SetupError> read_whole_file(const std::string& path, const std::string& what,
                                                  std::size_t most_bytes) {
  const std::string failure = "cannot read the " + what + " " + path + ": ";
  const OwnedDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) return bad_input(failure + std::strerror(errno) + "; check the name");
  ReadFiles::note(path);
  constexpr std::size_t kPiece = std::size_t{1} << 16U;
  std::string text;
  for (;;) {
    const std::size_t size = text.size();
    text.resize(size + kPiece);
    const auto got = ::read(file.get(), text.data() + size, kPiece);
    text.resize(size + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && errno == EISDIR) return bad_input(failure + "it is a directory; use a file");
    if (got < 0) return bad_input(failure + std::strerror(errno) + "; is it a regular file?");
    if (text.size() > most_bytes) {
      return bad_input(failure + "it is larger than " + std::to_string(most_bytes >> 20U) +
                       " MiB; is this the " + what + "?");
    }
    if (got == 0) return text;
  }
}

}  // namespace merkel
