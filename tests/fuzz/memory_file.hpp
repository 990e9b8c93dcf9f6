#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

namespace merkel {

/// An in-memory file, for readers that need a path.
class MemoryFile {
 public:
  MemoryFile() {
    if (descriptor_ < 0) std::abort();
  }

  /// Replaces the content by these bytes. Returns the path.
  const std::string& hold(const std::uint8_t* bytes, std::size_t size) {
    if (::ftruncate(descriptor_, 0) != 0 ||
        ::pwrite(descriptor_, bytes, size, 0) != static_cast<ssize_t>(size)) {
      std::abort();
    }
    return path_;
  }

 private:
  int descriptor_ = ::memfd_create("fuzzed", 0);
  std::string path_ = "/proc/self/fd/" + std::to_string(descriptor_);
};

}  // namespace merkel
