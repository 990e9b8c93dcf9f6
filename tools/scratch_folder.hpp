#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace merkel {

/// A temporary folder, removed with its content.
class ScratchFolder {
 public:
  /// \param purpose  a part of its name
  explicit ScratchFolder(const std::string& purpose) {
    std::error_code error;
    const auto above = std::filesystem::temp_directory_path(error);
    std::string pattern = (above / ("merkel-" + purpose + "-XXXXXX")).string();
    if (!error && ::mkdtemp(pattern.data()) != nullptr) path_ = pattern;
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    if (made()) std::filesystem::remove_all(path_, ignored);
  }

  /// False if the host refused.
  [[nodiscard]] bool made() const noexcept { return !path_.empty(); }
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace merkel
