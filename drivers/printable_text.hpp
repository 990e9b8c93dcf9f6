#pragma once

#include <string>
#include <string_view>

namespace merkel {

/// Makes untrusted text safe to print: control characters, invalid UTF-8 and characters that move
/// or hide others become '?', and the text is cut after `longest` bytes.
[[nodiscard]] std::string printable_text(std::string_view text, std::size_t longest = 400);

/// A text for formats of UTF-8: bytes that are none, and characters that XML forbids there, become
/// U+FFFD.
[[nodiscard]] std::string utf8_text(std::string_view text);

/// printable_text() for the name of a column of a CSV file: commas become '_'.
[[nodiscard]] std::string printable_column(std::string_view name);

/// Whether received bytes are text: at least 95 % are printable ASCII, blanks or line ends. At a
/// wrong baud rate, bytes are not.
[[nodiscard]] bool is_text(std::string_view bytes) noexcept;

/// What a device sent, for a message: the first line of text in quotation marks, or the first 32
/// bytes in hexadecimal ("the 36 bytes 12 34 ..."). Empty for no bytes.
[[nodiscard]] std::string quoted_answer(std::string_view bytes);

/// A message with what it quotes cut: of a word of more than 300 bytes, and of a message of more
/// than 4000, the beginning and the end stay, so that cause and advice can be read.
[[nodiscard]] std::string shortened(std::string_view message);

/// printable_text() for a text of several lines: line ends and tabs stay.
[[nodiscard]] std::string printable_lines(std::string_view text);

}  // namespace merkel
