#pragma once

#include <string>
#include <string_view>

namespace merkel {

/// Makes untrusted text safe to print: control characters, invalid UTF-8 and characters that move
/// or hide others become '?', and the text is cut after `longest` bytes.
[[nodiscard]] std::string printable_text(std::string_view text, std::size_t longest = 400);

/// The same for the name of a column of a CSV file: commas become '_'.
[[nodiscard]] std::string printable_column(std::string_view name);

/// A message with what it quotes cut: of a word of more than 300 bytes, and of a message of more
/// than 4000, the beginning and the end stay, so that cause and advice can be read.
[[nodiscard]] std::string shortened(std::string_view message);

/// printable_text() for a text of several lines: line ends and tabs stay.
[[nodiscard]] std::string printable_lines(std::string_view text);

}  // namespace merkel
