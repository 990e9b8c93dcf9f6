#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// A growing one-dimensional NumPy file. Its header tells of the values written by the last flush,
/// so that a reader finds whole values whenever it looks.
class NpyFile {
 public:
  /// \param type  NumPy's name of it: "<i8" or "<i4"
  [[nodiscard]] static Expected<NpyFile, SetupError> create(const std::string& path,
                                                            std::string_view type, bool overwrite);
  NpyFile(NpyFile&& other) noexcept;
  NpyFile& operator=(NpyFile&&) = delete;
  NpyFile(const NpyFile&) = delete;
  NpyFile& operator=(const NpyFile&) = delete;
  ~NpyFile();

  /// Buffers a value; a value that the type cannot hold is cut.
  void append(std::int64_t value);
  /// Writes the buffered values, then the header. False after an error.
  [[nodiscard]] bool flush();
  /// "cannot write NAME: No space left on device; …", after a false.
  [[nodiscard]] const std::string& error() const noexcept { return error_; }
  [[nodiscard]] std::uint64_t values() const noexcept { return values_; }

 private:
  NpyFile(std::string path, std::string_view type, int descriptor);
  bool write_at(std::uint64_t place, std::string_view bytes);

  std::string path_;
  std::string type_;
  int descriptor_;
  std::size_t value_bytes_;
  std::string buffer_;
  std::uint64_t values_ = 0;  ///< in the file
  std::string error_;
};

}  // namespace merkel
