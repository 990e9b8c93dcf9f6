#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace merkel {

/// Reads plain values from the front of a byte range; returns false at its end.
class ByteSpan {
 public:
  explicit ByteSpan(std::string_view bytes) : rest_(bytes) {}

  template <class T>
  [[nodiscard]] bool take(T& value) {
    if (rest_.size() < sizeof(T)) return false;
    std::memcpy(&value, rest_.data(), sizeof(T));
    rest_.remove_prefix(sizeof(T));
    return true;
  }
  /// Reads a count; the byte before it gives its width.
  [[nodiscard]] bool take_count(std::uint64_t& count) {
    std::uint8_t width = 0;
    if (!take(width)) return false;
    if (width == 1) return take_as<std::uint8_t>(count);
    if (width == 4) return take_as<std::uint32_t>(count);
    return width == 8 && take(count);
  }
  [[nodiscard]] bool take_text(std::uint64_t length, std::string_view& text) {
    if (length > rest_.size()) return false;
    text = rest_.substr(0, length);
    rest_.remove_prefix(length);
    return true;
  }
  [[nodiscard]] std::size_t left() const { return rest_.size(); }

 private:
  template <class Narrow>
  bool take_as(std::uint64_t& count) {
    Narrow narrow{};
    if (!take(narrow)) return false;
    count = narrow;
    return true;
  }
  std::string_view rest_;
};

}  // namespace merkel
