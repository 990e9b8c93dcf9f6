#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// Reads a text file line by line with one fixed buffer, whatever the length of the file. Accepts
/// LF and CRLF line ends and a UTF-8 byte-order mark.
class LineReader {
 public:
  /// A longer line is an error: the file is not a table.
  static constexpr std::size_t kMaxLine = 32'768;

  [[nodiscard]] static Expected<LineReader, SetupError> open(const std::string& path);

  enum class Outcome { kLine, kEnd, kError };
  /// Reads the next line, without its line end, into line(). On kError, error() has the reason.
  Outcome next();

  [[nodiscard]] std::string_view line() const noexcept { return line_; }
  /// Number of the last line, from 1.
  [[nodiscard]] std::uint64_t number() const noexcept { return number_; }
  [[nodiscard]] const std::string& error() const noexcept { return error_; }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  /// "path:line: ", the start of every message about a line.
  [[nodiscard]] std::string where() const;

 private:
  struct Close {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
  };
  LineReader(std::string path, std::FILE* file);
  bool refill();

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  bool at_end_ = false;
  std::string_view line_;
  std::uint64_t number_ = 0;
  std::string error_;
};

/// Reads a table of one file to its end.
/// \param take  called with each line that is neither empty nor a comment (#); returns what is
/// wrong with it, which is an error at its place, or nullptr
[[nodiscard]] Expected<void, SetupError> read_rows(
    const std::string& path, const std::function<const char*(std::string_view row)>& take);

}  // namespace merkel
