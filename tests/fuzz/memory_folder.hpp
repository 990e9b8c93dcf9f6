#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <string>
#include <string_view>

#include <unistd.h>

namespace merkel {

/// A folder in memory of this process, removed at its end, for readers of several files.
class MemoryFolder {
 public:
  explicit MemoryFolder(const std::string& name)
      : path_("/dev/shm/merkel-fuzz-" + name + "-" + std::to_string(::getpid())) {
    std::filesystem::create_directories(path_);
  }
  MemoryFolder(const MemoryFolder&) = delete;
  MemoryFolder& operator=(const MemoryFolder&) = delete;
  ~MemoryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  /// Replaces the contents of files by the parts of some bytes, separated by "|".
  void hold(std::string_view bytes, std::initializer_list<const char*> names) const {
    for (const char* const name : names) {
      const std::string_view content = bytes.substr(0, bytes.find('|'));
      std::ofstream(path_ + name, std::ios::binary) << content;
      bytes.remove_prefix(std::min(bytes.size(), content.size() + 1));
    }
  }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace merkel
