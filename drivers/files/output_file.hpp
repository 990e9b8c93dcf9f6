#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/expected.hpp"

namespace merkel {

/// A file being written, that never looks whole before it is.
///
/// Bytes go to NAME.part, which is readable up to the last flush whatever happens; close() gives
/// it its name. A device or pipe that exists already (/dev/stdout, a FIFO) is written directly, and
/// "-" is the standard output.
class OutputFile {
 public:
  /// Fails where the file or its .part exists (unless `overwrite`), cannot be made, or is being
  /// written by somebody else.
  [[nodiscard]] static Expected<OutputFile, SetupError> create(const std::string& path,
                                                               bool overwrite);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  /// Abandons the file unless close() was called: what was written stays in NAME.part, but for a
  /// header without anything behind it.
  ~OutputFile();

  /// Buffers bytes, and writes them out when there are many. False after an error.
  [[nodiscard]] bool write(std::string_view bytes);
  /// What was written so far is a header, worth nothing by itself.
  void end_header() noexcept { header_bytes_ = written_bytes_ + buffer_.size(); }
  /// Writes all buffered bytes out, or none of them. False after an error.
  [[nodiscard]] bool flush();
  /// Flushes, closes and renames. False after an error.
  [[nodiscard]] bool close();

  /// Whether every byte given to write() is written out.
  [[nodiscard]] bool settled() const noexcept { return buffer_.empty(); }
  /// "cannot write NAME: No space left on device; …", after a false.
  [[nodiscard]] const std::string& error() const noexcept { return error_; }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  OutputFile(std::string path, std::string part, int descriptor);
  bool fail(int error_number, std::string_view mend);

  std::string path_;
  std::string part_;  ///< empty where the path is written directly
  int descriptor_;
  std::string buffer_;
  std::uint64_t written_bytes_ = 0;
  std::uint64_t header_bytes_ = 0;
  std::string error_;
};

}  // namespace merkel
