#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace merkel {

/// Splits a stream of bytes into lines that end with CR, LF or both, in bounded memory. The first
/// line after a reset is dropped unless it is known to be whole: its start may be missing, and
/// "5.2" from "15.2" is also a number.
class LineSplitter {
 public:
  static constexpr std::size_t kMaxLine = 8192;

  void reset(bool first_is_whole) noexcept {
    length_ = 0;
    dropping_ = !first_is_whole;
    after_return_ = false;
  }
  /// Empty lines are lines.
  void keep_empty_lines() noexcept { keeps_empty_ = true; }

  /// The line that a byte completes, valid until the next call; empty lines are skipped, unless
  /// they are kept.
  [[nodiscard]] std::optional<std::string_view> take(std::uint8_t byte) noexcept {
    const bool second = after_return_ && byte == '\n';
    after_return_ = byte == '\r';
    if (second && length_ == 0) return std::nullopt;
    if (byte != '\n' && byte != '\r') {
      if (length_ < line_.size()) {
        line_[length_++] = static_cast<char>(byte);
      } else {
        if (!dropping_) ++too_long_;
        dropping_ = true;
      }
      return std::nullopt;
    }
    const std::size_t length = length_;
    const bool dropped = dropping_;
    length_ = 0;
    dropping_ = false;
    if (dropped || (length == 0 && !keeps_empty_)) return std::nullopt;
    return std::string_view(line_.data(), length);
  }

  /// The beginning of the line that is arriving.
  [[nodiscard]] std::string_view beginning() const noexcept { return {line_.data(), length_}; }

  /// The number of too long lines since the last call.
  [[nodiscard]] std::size_t take_too_long() noexcept {
    const std::size_t count = too_long_;
    too_long_ = 0;
    return count;
  }

 private:
  std::array<char, kMaxLine> line_{};
  std::size_t length_ = 0;
  std::size_t too_long_ = 0;
  bool dropping_ = true;
  bool after_return_ = false;
  bool keeps_empty_ = false;
};

}  // namespace merkel
