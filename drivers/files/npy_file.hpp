#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"
#include "drivers/files/output_file.hpp"

namespace merkel {

/// A growing NumPy file of one or two dimensions. Its header counts the values written by the last
/// flush, so NAME.part is always a valid file.
class NpyFile {
 public:
  /// \param type     NumPy's type name: "<i8", "<i4" or "<f8"
  /// \param columns  values per row; 0: one dimension
  [[nodiscard]] static Expected<NpyFile, SetupError> create(const std::string& path,
                                                            std::string_view type, bool overwrite,
                                                            std::size_t columns = 0);

  /// Buffers a whole number, truncated to the type. For "<i8" and "<i4".
  void append(std::int64_t value);
  /// Buffers a number. For "<f8".
  void append(double value);
  /// Writes the buffered values, then the header. False after an error.
  [[nodiscard]] bool flush();
  /// Flushes and renames the file to its final name. False after an error.
  [[nodiscard]] bool close();
  /// The last error: "cannot write NAME: No space left on device; …".
  [[nodiscard]] const std::string& error() const noexcept { return file_.error(); }
  [[nodiscard]] std::uint64_t values() const noexcept { return values_; }

 private:
  NpyFile(OutputFile file, std::string_view type, std::size_t columns);

  OutputFile file_;
  std::string type_;
  std::size_t columns_;
  std::size_t value_bytes_;
  std::string buffer_;
  std::uint64_t values_ = 0;  ///< in the file
};

/// The numbers of a NumPy file of one dimension.
struct NpyValues {
  bool whole = true;           ///< whole numbers
  std::vector<double> values;  ///< exact up to 2^53
};

/// Reads whole numbers of 2, 4 or 8 bytes, and doubles, little-endian. Accepts arbitrary bytes.
[[nodiscard]] Expected<NpyValues, SetupError> read_npy(const std::string& path);

}  // namespace merkel
