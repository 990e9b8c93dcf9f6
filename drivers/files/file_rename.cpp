#include "drivers/files/file_rename.hpp"

#include <cerrno>
#include <cstdio>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "drivers/files/owned_descriptor.hpp"

namespace merkel {

bool file_exists(const std::string& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) == 0;
}

int rename_without_replacing(const std::string& from, const std::string& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  // For file systems without this flag: create a second link, which fails if the name exists.
  if (::link(from.c_str(), to.c_str()) == 0) return ::unlink(from.c_str()) == 0 ? 0 : errno;
  if (errno == EEXIST) return EEXIST;
  // Neither flag nor links (FAT): a file that appears between these two lines is replaced.
  if (file_exists(to)) return EEXIST;
  return std::rename(from.c_str(), to.c_str()) == 0 ? 0 : errno;
}

int rename_to(const std::string& from, const std::string& to, bool replace) {
  if (!replace) return rename_without_replacing(from, to);
  return std::rename(from.c_str(), to.c_str()) == 0 ? 0 : errno;
}

int sync_file(int descriptor) {
  return ::fsync(descriptor) == 0 || errno == EINVAL ? 0 : errno;  // EINVAL: a pipe or device
}

int sync_file(const std::string& path) {
  const OwnedDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  return file.get() < 0 ? errno : sync_file(file.get());
}

int sync_directory_of(const std::string& path) {
  const auto slash = path.rfind('/');
  const std::string folder =
      slash == std::string::npos ? "." : path.substr(0, slash == 0 ? 1 : slash);
  const OwnedDescriptor file(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (file.get() < 0) return errno == EACCES ? 0 : errno;  // writable, but not readable
  return sync_file(file.get());
}

}  // namespace merkel
