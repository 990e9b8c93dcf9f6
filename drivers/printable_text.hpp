#pragma once

#include <string>
#include <string_view>

namespace merkel {

/// Makes untrusted text safe to print: control characters, invalid UTF-8 and characters that move
/// or hide others become '?', and the text is cut after `longest` bytes.
[[nodiscard]] std::string printable_text(std::string_view text, std::size_t longest = 400);

/// The same for the name of a column of a CSV file: commas become '_'.
[[nodiscard]] std::string printable_column(std::string_view name);

/// The same for a text of several lines: line ends and tabs stay.
[[nodiscard]] std::string printable_lines(std::string_view text);

}  // namespace merkel
