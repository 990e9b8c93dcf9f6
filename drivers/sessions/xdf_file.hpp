#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "core/expected.hpp"
#include "drivers/sessions/session_format.hpp"

namespace merkel {

/// A chunk of an XDF file, without its length.
struct XdfChunk {
  XdfTag tag = XdfTag::kBoundary;
  std::string content;
};

/// Reads the chunks of an XDF file. The memory is bounded: longer chunks than those of a session
/// are skipped.
class XdfFile {
 public:
  [[nodiscard]] static Expected<XdfFile, SetupError> open(const std::string& path);

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  /// Reads the next chunk. False at the end.
  [[nodiscard]] Expected<bool, SetupError> next(XdfChunk& chunk);
  /// True if the file ended within a chunk: its writer was stopped there.
  [[nodiscard]] bool truncated() const noexcept { return truncated_; }
  /// Goes back to the first chunk.
  void rewind();
  /// The error that the chunk read last is damaged.
  [[nodiscard]] Unexpected<SetupError> damaged(const std::string& what) const;

 private:
  struct Close {
    void operator()(std::FILE* file) const { static_cast<void>(std::fclose(file)); }
  };

  XdfFile(std::string path, std::unique_ptr<std::FILE, Close> file, std::uint64_t size)
      : path_(std::move(path)), file_(std::move(file)), size_(size) {}
  [[nodiscard]] bool read_bytes(void* bytes, std::size_t count);

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t size_;
  std::uint64_t place_ = 0;        ///< bytes read so far
  std::uint64_t chunk_start_ = 0;  ///< of the chunk read last
  bool truncated_ = false;
};

}  // namespace merkel
