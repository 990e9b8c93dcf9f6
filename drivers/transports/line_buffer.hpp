#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/parameters/range.hpp"

namespace merkel {

/// Lines "TIME,VALUE,…" that a port makes of a stream's messages, until they are read as bytes.
class LineBuffer {
 public:
  /// \param time_s  as text; "nan": not known
  void add(std::string_view time_s, std::span<const double> values) {
    text_ += time_s;
    for (const double value : values) text_.append(",").append(shortest_decimal(value));
    text_ += '\n';
  }
  [[nodiscard]] bool empty() const noexcept { return text_.empty(); }
  [[nodiscard]] std::size_t size() const noexcept { return text_.size(); }
  void clear() noexcept { text_.clear(); }
  /// Moves what fits into `bytes`. \return the number of bytes
  std::size_t take(std::span<std::uint8_t> bytes) {
    const std::size_t count = std::min(bytes.size(), text_.size());
    std::copy_n(text_.begin(), count, bytes.begin());
    text_.erase(0, count);
    return count;
  }

 private:
  std::string text_;
};

}  // namespace merkel
