#pragma once

#include <string>
#include <string_view>

namespace merkel {

/// Text from outside, made safe to print: control characters, broken UTF-8 and characters that move
/// or hide others become '?', and what is longer than `longest` bytes is cut.
[[nodiscard]] std::string printable_text(std::string_view text, std::size_t longest = 400);

}  // namespace merkel
