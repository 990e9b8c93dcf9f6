#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace merkel {

/// True for a line of nothing but numbers and their separators.
[[nodiscard]] bool is_line_of_numbers(std::string_view line) noexcept;

/// Joins the lines of a frame, such as the 12 lines of an array of 12 × 12 taxels, to one row. Any
/// line that is not of numbers, such as an empty one, stands between two frames. Until the first of
/// those, nothing is known to be the beginning of a frame.
class FrameLines {
 public:
  enum class Result { kNone, kFrame, kDamaged, kNeverSeparated };

  /// \param lines  of a frame
  explicit FrameLines(std::size_t lines) : lines_(lines) {}

  [[nodiscard]] std::size_t lines() const noexcept { return lines_; }
  /// The next line may be anywhere in a frame.
  void reset() noexcept;
  /// kFrame at the last line of a frame; kDamaged once if one has too few or too many lines.
  Result take(std::string_view line);
  /// The last frame, its lines separated as their numbers are. Valid until the next take().
  [[nodiscard]] const std::string& row() const noexcept { return row_; }

 private:
  static constexpr std::size_t kMaxRow = 65'536;

  std::size_t lines_;
  std::string row_;
  std::size_t count_ = 0;   ///< lines of the present frame
  bool aligned_ = false;    ///< its beginning is known
  std::size_t before_ = 0;  ///< lines without
};

}  // namespace merkel
